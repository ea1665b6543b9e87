#include <png.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/output_file.hpp"
#include "batch/batch.hpp"
#include "batch/overview.hpp"
#include "batch/status.hpp"
#include "batch/summary_table.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::batch {
namespace {

using nlohmann::json;

/// RFC 4180: quoted where needed, quotes doubled.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_line(const std::vector<std::string>& fields) {
  std::string line;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (i > 0) line += ',';
    line += csv_field(fields[i]);
  }
  line += '\n';
  return line;
}

std::string csv(const SummaryTable& table) {
  std::string text = csv_line(table.columns);
  for (const SummaryRow& row : table.rows) text += csv_line(row.cells);
  return text;
}

json counts(const std::vector<EntryStatus>& entries) {
  json result;
  for (const EntryState state : kEntryStates) {
    result[to_string(state)] = std::ranges::count(entries, state, &EntryStatus::state);
  }
  return result;
}

/// Nothing when there is no PNG of that name that can be read, or a larger one than is ever
/// written.
std::optional<Image> read_picture(const std::filesystem::path& path) {
  constexpr png_uint_32 kLongestSide = 16384;
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) return std::nullopt;
  if (std::max(png.width, png.height) > kLongestSide) {
    png_image_free(&png);
    return std::nullopt;
  }
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.pixels.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
    return std::nullopt;
  }
  return image;
}

/// At most `width` pixels wide: whole pixels averaged in squares.
Image shrunk(const Image& image, int width) {
  const int step = (image.width + width - 1) / width;
  if (step <= 1) return image;
  Image small{image.width / step, std::max(image.height / step, 1), {}};
  const int tall = std::min(step, image.height);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        unsigned sum = 0;
        for (int v = 0; v < tall; ++v) {
          for (int u = 0; u < step; ++u) {
            const auto pixel =
                static_cast<std::size_t>(y * step + v) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x * step + u);
            sum += image.pixels[3 * pixel + static_cast<std::size_t>(channel)];
          }
        }
        const auto area = static_cast<unsigned>(tall * step);
        small.pixels.push_back(static_cast<std::uint8_t>((sum + area / 2) / area));
      }
    }
  }
  return small;
}

/// Every picture there is, in the entries' order, made small, with its name.
void write_contact_sheet(const std::filesystem::path& folder,
                         const std::vector<EntryStatus>& entries) {
  constexpr int kWidth = 320;
  constexpr int kGap = 4;
  std::vector<Image> images;
  for (const EntryStatus& entry : entries) {
    if (entry.state != EntryState::done) continue;
    for (const std::string& name : entry.files) {
      if (!name.ends_with(".png")) continue;
      // One that was removed or spoilt since is left out.
      if (auto image = read_picture(folder / name)) {
        images.push_back(captioned(shrunk(*image, kWidth), entry.name));
      }
    }
  }
  if (images.empty()) return;
  const int columns =
      std::clamp(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(images.size())))), 1, 10);
  write_png(contact_sheet(images, columns, kGap), folder / "contact_sheet.png");
}

}  // namespace

void write_summary(const std::filesystem::path& folder, const std::vector<EntryStatus>& entries) {
  json all = json::array();
  for (const EntryStatus& entry : entries) {
    json one = entry.to_json();
    one.erase("progress");
    all.push_back(std::move(one));
  }
  write_json(folder / "summary.json", {{"counts", counts(entries)}, {"entries", std::move(all)}});
  const SummaryTable table = summary_table(entries);
  base::write_file(folder / "summary.csv", csv(table));
  base::write_file(folder / "index.html", overview(entries, table));
  write_contact_sheet(folder, entries);
}

}  // namespace qjulia::batch
