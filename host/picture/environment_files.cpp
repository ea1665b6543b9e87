#include <ImathBox.h>
#include <ImfIO.h>
#include <ImfRgbaFile.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "base/input_file.hpp"
#include "base/text.hpp"
#include "picture/embedded_environments.hpp"
#include "picture/environment.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/light.hpp"

namespace qjulia::picture {
namespace {

constexpr std::string_view kEnvironmentsFolder = "environments/", kHdr = ".hdr", kExr = ".exr";
constexpr int kWidestEnvironment = 16384;
constexpr std::uint64_t kLargestEnvironment = std::uint64_t{1} << 30;

std::string embedded_path(std::string_view name) {
  return fmt::format("{}{}{}", kEnvironmentsFolder, name, kHdr);
}

/// @throws InputError
void expect_environment_size(long width, long height) {
  if (width < 4 || width > kWidestEnvironment || width != 2 * height) {
    throw InputError(
        fmt::format("it has {} x {} pixels; an environment is twice as wide as high, "
                    "as equirectangular panoramas are, and 4 to {} wide",
                    width, height, kWidestEnvironment));
  }
}

/// Reads the bytes of a Radiance picture.
class RadianceReader {
 public:
  explicit RadianceReader(std::string_view bytes) : bytes_(bytes) {}

  Environment picture() {
    if (!bytes_.starts_with("#?")) throw InputError("it is no Radiance picture");
    bool is_rgbe = false;
    for (std::string text = line(); !text.empty(); text = line()) {
      if (text == "FORMAT=32-bit_rle_rgbe") is_rgbe = true;
    }
    if (!is_rgbe) throw InputError("it is not in the format 32-bit_rle_rgbe");
    read_size();
    Environment made{width_, height_, {}};
    // No memory is taken for rows that the file promises and does not have.
    for (int row = 0; row < height_; ++row) read_row(made.radiance);
    return made;
  }

 private:
  using Rgbe = std::array<std::uint8_t, 4>;

  [[noreturn]] static void throw_cut() { throw InputError("it ends in the middle"); }

  std::string line() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) throw_cut();
    std::string text(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    if (text.ends_with('\r')) text.pop_back();
    return text;
  }

  void read_size() {
    const auto words = base::split(line(), ' ');
    const auto number = [&](std::size_t i) { return base::number_in<int>(words[i]).value_or(0); };
    if (words.size() != 4 || words[0] != "-Y" || words[2] != "+X") {
      throw InputError("its rows do not go from the top, or not from the left");
    }
    height_ = number(1);
    width_ = number(3);
    expect_environment_size(width_, height_);
  }

  std::uint8_t byte() {
    if (at_ >= bytes_.size()) throw_cut();
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }

  Rgbe pixel() { return {byte(), byte(), byte(), byte()}; }

  void read_row(std::vector<Eigen::Vector3f>& out) {
    std::vector<Rgbe> row;
    const Rgbe first = pixel();
    if (first[0] == 2 && first[1] == 2 && 256 * first[2] + first[3] == width_ && width_ < 0x8000) {
      row.resize(static_cast<std::size_t>(width_));
      for (std::size_t channel = 0; channel < 4; ++channel) read_runs(row, channel);
    } else {
      read_flat(row, first);
    }
    for (const Rgbe& c : row) {
      const float scale = c[3] == 0 ? 0 : std::ldexp(1.0F, int{c[3]} - 136);
      out.emplace_back(scale * (Eigen::Vector3f(c[0], c[1], c[2]).array() + 0.5F).matrix());
    }
  }

  /// A channel of a row: runs of one value, and literal values.
  void read_runs(std::vector<Rgbe>& row, std::size_t channel) {
    for (std::size_t i = 0; i < row.size();) {
      std::size_t count = byte();
      const bool is_run = count > 128;
      if (is_run) count -= 128;
      if (count == 0 || i + count > row.size())
        throw InputError("a run of it is longer than a row");
      const std::uint8_t value = is_run ? byte() : std::uint8_t{0};
      for (; count > 0; --count) row[i++][channel] = is_run ? value : byte();
    }
  }

  /// Pixel by pixel; 1, 1, 1, n repeats the last one n times, and what follows it 256 n times.
  void read_flat(std::vector<Rgbe>& row, Rgbe next) {
    const auto wide = static_cast<std::size_t>(width_);
    for (unsigned shift = 0;;) {
      if (next[0] == 1 && next[1] == 1 && next[2] == 1) {
        const std::size_t count = shift > 16 ? wide + 1 : std::size_t{next[3]} << shift;
        if (row.empty() || row.size() + count > wide) {
          throw InputError("a run of it is longer than a row");
        }
        row.insert(row.end(), count, Rgbe(row.back()));
        shift += 8;
      } else {
        row.push_back(next);
        shift = 0;
      }
      if (row.size() == wide) return;
      next = pixel();
    }
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  int width_ = 0, height_ = 0;
};

/// Bytes in memory as OpenEXR reads them.
class ExrBytes : public Imf::IStream {
 public:
  explicit ExrBytes(std::string_view bytes) : IStream("environment"), bytes_(bytes) {}

  bool isMemoryMapped() const override { return false; }
  bool read(char to[], int count) override {
    const auto wanted = static_cast<std::size_t>(count);
    if (count < 0 || wanted > bytes_.size() - std::min(at_, bytes_.size())) {
      throw InputError("it ends in the middle");
    }
    std::memcpy(to, bytes_.data() + at_, wanted);
    at_ += wanted;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t place) override { at_ = place; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

void expect_light(const Environment& made) {
  double sum = 0;
  for (const Eigen::Vector3f& c : made.radiance) {
    if (!c.allFinite()) throw InputError("a pixel of it is infinite or no number");
    sum += double{c.sum()};
  }
  if (!(sum > 0)) throw InputError("all of it is black");
}

}  // namespace

Environment environment_from_hdr(std::string_view bytes) {
  Environment made = RadianceReader(bytes).picture();
  expect_light(made);
  return made;
}

Environment environment_from_exr(std::string_view bytes) {
  Environment made;
  try {
    ExrBytes stream(bytes);
    Imf::RgbaInputFile file(stream);
    const Imath::Box2i window = file.dataWindow();
    const auto side = [](int low, int high) { return long{high} - long{low} + 1; };
    expect_environment_size(side(window.min.x, window.max.x), side(window.min.y, window.max.y));
    made.width = window.max.x - window.min.x + 1;
    made.height = window.max.y - window.min.y + 1;
    const auto wide = static_cast<std::size_t>(made.width);
    std::vector<Imf::Rgba> row(wide);
    // The library adds a pixel's column to its base; all rows go to the same place.
    file.setFrameBuffer(row.data() - window.min.x, 1, 0);
    for (int y = window.min.y; y <= window.max.y; ++y) {
      file.readPixels(y);
      for (const Imf::Rgba& c : row) {
        made.radiance.emplace_back(std::max(float(c.r), 0.0F), std::max(float(c.g), 0.0F),
                                   std::max(float(c.b), 0.0F));
      }
    }
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(fmt::format("OpenEXR cannot read it ({})", error.what()));
  }
  expect_light(made);
  return made;
}

void expect_environment(const std::string& name_or_file) {
  const auto names = environment_names();
  if (std::ranges::count(names, name_or_file) > 0 || name_or_file.ends_with(kHdr) ||
      name_or_file.ends_with(kExr)) {
    return;
  }
  throw OptionError("environment",
                    fmt::format("'{}' is not known; give {}, or a file that ends in .hdr or .exr",
                                name_or_file, fmt::join(names, ", ")));
}

Environment read_environment(const std::string& name_or_file, const std::stop_token& stop) {
  expect_environment(name_or_file);
  const auto found = embedded_environments().find(embedded_path(name_or_file));
  if (found != embedded_environments().end()) return environment_from_hdr(found->second);
  std::string bytes;
  base::InputFile(name_or_file, "environment", kLargestEnvironment, stop).read_all(bytes);
  try {
    return name_or_file.ends_with(kHdr) ? environment_from_hdr(bytes) : environment_from_exr(bytes);
  } catch (const InputError& error) {
    throw InputError(
        fmt::format("cannot read environment '{}': {}", base::to_utf8(name_or_file), error.what()));
  }
}

}  // namespace qjulia::picture

namespace qjulia {

std::vector<std::string> environment_names() {
  using namespace picture;
  std::vector<std::string> names;
  for (const auto& [path, bytes] : embedded_environments()) {
    const std::size_t around = kEnvironmentsFolder.size() + kHdr.size();
    names.push_back(path.substr(kEnvironmentsFolder.size(), path.size() - around));
  }
  return names;
}

}  // namespace qjulia
