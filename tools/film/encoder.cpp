#include "film/encoder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "base/file_types.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::film {
namespace {

using Words = std::vector<std::string>;

/// Players take only even widths and heights, and colours by the matrix of HDTV.
constexpr const char* kForPlayers =
    "crop=trunc(iw/2)*2:trunc(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv";
const Words kBt709{"-colorspace", "bt709", "-color_primaries", "bt709",
                   "-color_trc",  "bt709", "-color_range",     "tv"};

Words with_colors(Words words) {
  words.insert(words.end(), kBt709.begin(), kBt709.end());
  return words;
}

/// The words of each type, after the input's.
Words words_of_type(const std::string& type, bool is_transparent) {
  if (type == ".mp4") {
    return with_colors({"-vf", kForPlayers, "-c:v", "libx264", "-preset", "slow", "-crf", "17",
                        "-pix_fmt", "yuv420p", "-movflags", "+faststart"});
  }
  if (type == ".webm" && is_transparent) {
    return {"-c:v", "libvpx-vp9", "-crf", "20", "-b:v", "0", "-pix_fmt", "yuva420p"};
  }
  if (type == ".webm") {
    return with_colors({"-vf", kForPlayers, "-c:v", "libsvtav1", "-crf", "26", "-preset", "6",
                        "-pix_fmt", "yuv420p10le"});
  }
  if (type == ".webp") {
    return {"-c:v", "libwebp_anim", "-lossless", "0", "-q:v", "85", "-loop", "0"};
  }
  if (type == ".gif") {
    return {"-filter_complex",
            "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=sierra2_4a",
            "-loop", "0"};
  }
  return {"-f", "apng", "-plays", "0"};
}

/// The pattern by which FFmpeg finds the folder's pictures. A per cent sign of a name is doubled.
std::string pattern_of(const std::filesystem::path& folder) {
  std::string pattern;
  for (const char c : (folder / "").string()) pattern += c == '%' ? "%%" : std::string(1, c);
  return pattern + "frame_%04d.png";
}

}  // namespace

const std::vector<std::string>& film_types() {
  static const std::vector<std::string> all{".mp4", ".webm", ".webp", ".gif", ".apng"};
  return all;
}

void expect_size(const std::filesystem::path& output, int width, int height, bool is_transparent) {
  constexpr int kPair = 2;          // H.264 has colours for pairs of pixels alone
  constexpr int kLeastAv1 = 64;     // SVT-AV1
  constexpr int kMostWebp = 16383;  // 14 bits
  const std::string type = base::extension_of(output);
  const int least = type == ".mp4" ? kPair : type == ".webm" && !is_transparent ? kLeastAv1 : 1;
  if (std::min(width, height) < least) {
    throw InputError(
        fmt::format("a {} film needs pictures of {} x {} pixels at least, and these "
                    "have {} x {}; give a larger `size`, or make a .webp",
                    type, least, least, width, height));
  }
  if (type == ".webp" && std::max(width, height) > kMostWebp) {
    throw InputError(
        fmt::format("a .webp film has at most {} pixels a side; give a smaller "
                    "`size`, or make an .mp4",
                    kMostWebp));
  }
}

bool has_encoder() {
  const char* const path = std::getenv("PATH");
  if (path == nullptr) return false;
  const std::vector<std::string> folders = base::split(path, ':');
  return std::ranges::any_of(folders, [](const std::string& folder) {
    return ::access((std::filesystem::path(folder) / "ffmpeg").c_str(), X_OK) == 0;
  });
}

std::string frame_name(std::size_t number) { return fmt::format("frame_{:04}.png", number); }

bool is_frame_name(std::string_view name) {
  constexpr std::string_view kBegin = "frame_", kEnd = ".png";
  if (!name.starts_with(kBegin) || !name.ends_with(kEnd)) return false;
  name.remove_prefix(kBegin.size());
  name.remove_suffix(kEnd.size());
  return name.size() >= 4 && name.find_first_not_of("0123456789") == std::string_view::npos;
}

std::vector<std::string> encoder_words(const Encoding& encoding) {
  Words words{"ffmpeg",
              "-hide_banner",
              "-loglevel",
              "error",
              "-y",
              "-framerate",
              fmt::format("{}", encoding.rate),
              "-start_number",
              "1"};
  if (encoding.times > 1) {
    words.insert(words.end(), {"-stream_loop", fmt::format("{}", encoding.times - 1)});
  }
  words.insert(words.end(), {"-i", "file:" + pattern_of(encoding.frames)});
  const Words own = words_of_type(base::extension_of(encoding.output), encoding.is_transparent);
  words.insert(words.end(), own.begin(), own.end());
  words.insert(words.end(),
               {"-frames:v",
                fmt::format("{}", encoding.pictures * static_cast<std::size_t>(encoding.times))});
  if (!encoding.note.empty()) {
    words.insert(words.end(), {"-metadata", "comment=" + encoding.note});
  }
  words.push_back("file:" + encoding.output.string());
  return words;
}

}  // namespace qjulia::film
