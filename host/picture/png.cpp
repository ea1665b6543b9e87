#include <png.h>

#include <vector>

#include "files/atomic_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/picture.hpp"

namespace qjulia {

void write_png(const Image& image, const std::filesystem::path& path) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() !=
          3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw InputError("a picture without pixels cannot be written");
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  std::vector<char> bytes(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr) ==
      0) {
    throw OutputError("cannot encode '" + path.string() + "' as PNG: " + png.message);
  }
  AtomicFile file(path);
  file.stream().write(bytes.data(), static_cast<std::streamsize>(size));
  file.commit();
}

}  // namespace qjulia
