#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/map_chunk.hpp"
#include "base/npy.hpp"
#include "base/output_file.hpp"
#include "base/range_check.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {
namespace {

/// The signature and the header chunk, after which text may stand.
constexpr std::size_t kHeaderBytes = 8 + 25;

/// 4 bytes, the highest first.
std::string number(std::size_t value) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes.push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
  return bytes;
}

/// A chunk (PNG specification, 5.3): length, type, data, CRC of all but the length.
std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  return number(data.size()) + body +
         number(crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size()));
}

/// Calls `take` with the type and the data of each chunk of a file.
template <class Take>
void for_chunks(const std::string& png, const Take& take) {
  constexpr std::size_t kAround = 12;  // length, type, CRC
  for (std::size_t at = 8; at + kAround <= png.size();) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size = 256 * size + static_cast<std::uint8_t>(png[at + i]);
    take(png.substr(at + 4, 4), png.substr(at + 8, size));
    at += kAround + size;
  }
}

void write_npy(const std::vector<float>& values, std::span<const std::size_t> shape,
               const std::filesystem::path& path) {
  base::OutputFile file(path);
  file.stream() << base::npy_header(shape, false);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(float)));
  file.commit();
}

/// A PNG of 16 bits.
class DeepPng {
 public:
  explicit DeepPng(const Image& image) {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, fail, nullptr);
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
    if (info_ == nullptr) throw OutputError("cannot encode a picture as PNG: there is no memory");
    const std::size_t channels = image.alpha.empty() ? 3 : 4;
    const auto wide = static_cast<std::size_t>(image.width);
    // Rows have the higher byte of each number first.
    for (const std::uint16_t value : image.deep) {
      bytes_.push_back(static_cast<png_byte>(value >> 8U));
      bytes_.push_back(static_cast<png_byte>(value & 0xFFU));
    }
    png_set_write_fn(png_, &encoded_, append, nullptr);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width),
                 static_cast<png_uint_32>(image.height), 16,
                 channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png_, info_);
    for (std::size_t row = 0; row < bytes_.size(); row += 2 * channels * wide) {
      png_write_row(png_, bytes_.data() + row);
    }
    png_write_end(png_, info_);
  }
  ~DeepPng() { png_destroy_write_struct(&png_, &info_); }
  DeepPng(const DeepPng&) = delete;
  DeepPng& operator=(const DeepPng&) = delete;

  const std::string& bytes() const { return encoded_; }

 private:
  [[noreturn]] static void fail(png_structp /*png*/, png_const_charp what) {
    throw OutputError(std::string("cannot encode a picture as PNG: ") + what);
  }
  static void append(png_structp png, png_bytep data, std::size_t size) {
    static_cast<std::string*>(png_get_io_ptr(png))
        ->append(reinterpret_cast<const char*>(data), size);
  }

  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::vector<png_byte> bytes_;
  std::string encoded_;
};

/// @throws OutputError
std::string encoded_png(const Image& image, Packing packing) {
  if (!image.deep.empty()) return DeepPng(image).bytes();
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = image.alpha.empty() ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  if (packing == Packing::quick) png.flags |= PNG_IMAGE_FLAG_FAST;
  std::vector<std::uint8_t> mixed;
  for (std::size_t i = 0; i < image.alpha.size(); ++i) {
    const auto rgb = image.pixels.begin() + static_cast<std::ptrdiff_t>(3 * i);
    mixed.insert(mixed.end(), rgb, rgb + 3);
    mixed.push_back(image.alpha[i]);
  }
  const std::vector<std::uint8_t>& rows = image.alpha.empty() ? image.pixels : mixed;
  std::string encoded(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = encoded.size();
  if (png_image_write_to_memory(&png, encoded.data(), &size, 0, rows.data(), 0, nullptr) == 0) {
    throw OutputError(std::string("cannot encode a picture as PNG: ") + png.message);
  }
  encoded.resize(size);
  return encoded;
}

/// White at the least depth, a quarter at the greatest, black where nothing is.
Image depth_image(const std::vector<float>& depths, int width, int height) {
  float nearest = INFINITY, farthest = 0;
  for (const float depth : depths) {
    if (!std::isfinite(depth)) continue;
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  const float range = std::max(farthest - nearest, 1e-30F);
  Image image{width, height, {}};
  for (const float depth : depths) {
    const float share = std::isfinite(depth) ? 1 - 0.75F * (depth - nearest) / range : 0;
    image.pixels.insert(image.pixels.end(), 3, static_cast<std::uint8_t>(std::lround(255 * share)));
  }
  return image;
}

Image normal_image(const std::vector<float>& normals, int width, int height) {
  Image image{width, height, {}};
  for (const float c : normals) {
    image.pixels.push_back(static_cast<std::uint8_t>(std::lround(127.5F * (1 + c))));
  }
  return image;
}

}  // namespace

void Image::validate() const {
  if (width < 1 || height < 1) throw InputError("the picture has no pixels");
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (pixels.size() != 3 * count || (!alpha.empty() && alpha.size() != count)) {
    throw InputError(
        fmt::format("a picture of {} x {} pixels has {} numbers for colors and {} for "
                    "alpha: it needs {} and {}, or no alpha",
                    width, height, pixels.size(), alpha.size(), 3 * count, count));
  }
  const std::size_t numbers = (alpha.empty() ? 3 : 4) * count;
  if (!deep.empty() && deep.size() != numbers) {
    throw InputError(
        fmt::format("a picture of {} x {} pixels has {} numbers of 16 bits: it needs {}", width,
                    height, deep.size(), numbers));
  }
}

std::string png_bytes(const Image& image, const PictureText& text, Packing packing,
                      const std::string& map) {
  image.validate();
  const std::string encoded = encoded_png(image, packing);
  std::string bytes = encoded.substr(0, kHeaderBytes);
  for (const auto& [keyword, value] : text) {
    std::string content = keyword;
    content.append(1, '\0').append(value);
    bytes += chunk("tEXt", content);
  }
  for (std::size_t at = 0; at < map.size(); at += base::kLargestPngMapChunk) {
    bytes += chunk(std::string(base::kPngMapChunk), map.substr(at, base::kLargestPngMapChunk));
  }
  return bytes.append(encoded, kHeaderBytes);
}

std::string animated_png_bytes(std::span<const Image> images, double seconds) {
  if (images.empty()) throw InputError("there is no picture to show");
  base::expect_between("seconds", seconds, 0.001, 65.0);
  const Image& first = images.front();
  // PNG specification, third edition, 11.3.6.
  const std::string control = number(images.size()) + number(0);
  const auto milliseconds = static_cast<std::size_t>(std::lround(1000 * seconds));
  const auto frame_control = [&](std::size_t sequence) {
    const std::string times = number(milliseconds).substr(2) + number(1000).substr(2);
    return number(sequence) + number(static_cast<std::size_t>(first.width)) +
           number(static_cast<std::size_t>(first.height)) + number(0) + number(0) + times +
           std::string(2, '\0');
  };
  std::string bytes;
  std::size_t sequence = 0;
  for (const Image& image : images) {
    if (image.width != first.width || image.height != first.height) {
      throw InputError("pictures that follow one another have one size");
    }
    Image shown = image;
    shown.deep.clear();  // all have 8 bits
    const std::string png = png_bytes(shown);
    const bool is_first = bytes.empty();
    if (is_first) bytes = png.substr(0, kHeaderBytes) + chunk("acTL", control);
    bytes += chunk("fcTL", frame_control(sequence++));
    for_chunks(png, [&](const std::string& type, const std::string& data) {
      if (type != "IDAT") return;
      bytes += is_first ? chunk("IDAT", data) : chunk("fdAT", number(sequence++) + data);
    });
  }
  return bytes + chunk("IEND", "");
}

void write_png(const Image& image, const std::filesystem::path& path, const PictureText& text,
               const std::string& map) {
  base::write_file(path, png_bytes(image, text, Packing::small, map));
}

std::vector<std::filesystem::path> layer_files(const std::filesystem::path& prefix) {
  std::vector<std::filesystem::path> paths;
  for (const char* ending :
       {".depth.npy", ".normal.npy", ".position.npy", ".depth.png", ".normal.png"}) {
    paths.emplace_back(prefix.string() + ending);
  }
  return paths;
}

std::vector<std::filesystem::path> write_layers(const PictureLayers& layers, int width,
                                                const std::filesystem::path& prefix) {
  const auto wide = static_cast<std::size_t>(std::max(width, 0));
  if (wide == 0 || layers.depth.size() % wide != 0 ||
      layers.normal.size() != 3 * layers.depth.size() ||
      layers.position.size() != 3 * layers.depth.size()) {
    throw InputError(fmt::format("the layers do not fit a picture {} pixels wide", width));
  }
  const std::size_t deep = layers.depth.size() / wide;
  const std::array<std::size_t, 3> shape{deep, wide, 3};
  const int height = static_cast<int>(deep);
  auto paths = layer_files(prefix);
  write_npy(layers.depth, std::span(shape).first(2), paths[0]);
  write_npy(layers.normal, shape, paths[1]);
  write_npy(layers.position, shape, paths[2]);
  write_png(depth_image(layers.depth, width, height), paths[3]);
  write_png(normal_image(layers.normal, width, height), paths[4]);
  return paths;
}

}  // namespace qjulia
