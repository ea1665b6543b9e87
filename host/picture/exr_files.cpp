#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {
namespace {

/// Bytes in memory that OpenEXR writes.
class ExrOutput : public Imf::OStream {
 public:
  ExrOutput() : OStream("picture") {}

  void write(const char from[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    bytes_.resize(std::max(bytes_.size(), at_ + size));
    std::copy_n(from, size, bytes_.begin() + static_cast<std::ptrdiff_t>(at_));
    at_ += size;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t place) override { at_ = place; }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

/// The channels of a file, each an array of its own.
class Channels {
 public:
  Channels(int width, int height)
      : width_(width),
        header_(width, height),
        count_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    header_.compression() = Imf::ZIP_COMPRESSION;
  }

  Imf::Header& header() { return header_; }

  /// @param names of the numbers that a pixel has. @throws InputError where there are others.
  void add_halves(const std::string& layer, const std::vector<std::string>& names,
                  const std::vector<float>& values) {
    constexpr float kMost = 65504;
    expect_size(layer, names, values);
    for (std::size_t part = 0; part < names.size(); ++part) {
      std::vector<half>& channel = halves_.emplace_back(count_);
      for (std::size_t i = 0; i < count_; ++i) {
        channel[i] = half(std::clamp(values[names.size() * i + part], -kMost, kMost));
      }
      insert(name_of(layer, names[part]), Imf::HALF, reinterpret_cast<char*>(channel.data()),
             sizeof(half));
    }
  }
  void add_floats(const std::string& layer, const std::vector<std::string>& names,
                  const std::vector<float>& values) {
    expect_size(layer, names, values);
    for (std::size_t part = 0; part < names.size(); ++part) {
      std::vector<float>& channel = floats_.emplace_back(count_);
      for (std::size_t i = 0; i < count_; ++i) channel[i] = values[names.size() * i + part];
      insert(name_of(layer, names[part]), Imf::FLOAT, reinterpret_cast<char*>(channel.data()),
             sizeof(float));
    }
  }

  std::string bytes() {
    ExrOutput out;
    {
      Imf::OutputFile file(out, header_);
      file.setFrameBuffer(frame_);
      file.writePixels(static_cast<int>(count_) / width_);
    }
    return out.take();
  }

 private:
  static std::string name_of(const std::string& layer, const std::string& name) {
    return layer.empty() ? name : layer + "." + name;
  }
  void expect_size(const std::string& layer, const std::vector<std::string>& names,
                   const std::vector<float>& values) const {
    if (values.size() == names.size() * count_) return;
    throw InputError(fmt::format("the layer '{}' has {} numbers for {} pixels",
                                 name_of(layer, names.front()), values.size(), count_));
  }
  void insert(const std::string& name, Imf::PixelType type, char* base, std::size_t size) {
    header_.channels().insert(name, Imf::Channel(type));
    frame_.insert(name, Imf::Slice(type, base, size, size * static_cast<std::size_t>(width_)));
  }

  int width_;
  Imf::Header header_;
  std::size_t count_;
  std::deque<std::vector<half>> halves_;
  std::deque<std::vector<float>> floats_;
  Imf::FrameBuffer frame_;
};

}  // namespace

std::string exr_bytes(const LayeredImage& picture, const PictureText& text) {
  const auto& [image, layers] = picture;
  if (image.width < 1 || image.height < 1) throw InputError("the picture has no pixels");
  const std::vector<std::string> rgb{"R", "G", "B"}, xyz{"X", "Y", "Z"};
  Channels channels(image.width, image.height);
  for (const auto& [keyword, value] : text) {
    channels.header().insert(keyword, Imf::StringAttribute(value));
  }
  channels.add_halves("", {"R", "G", "B", "A"}, layers.beauty);
  channels.add_floats("", {"Z"}, layers.depth);
  channels.add_floats("P", xyz, layers.position);
  channels.add_halves("N", xyz, layers.normal);
  channels.add_halves("albedo", rgb, layers.albedo);
  channels.add_halves("mask", rgb, layers.mask);
  if (!layers.value.empty()) channels.add_floats("value", {"Y"}, layers.value);
  for (const LightLayer& light : layers.light) channels.add_halves(light.name, rgb, light.color);
  try {
    return channels.bytes();
  } catch (const std::exception& error) {
    throw OutputError(fmt::format("cannot encode a picture as OpenEXR: {}", error.what()));
  }
}

void write_exr(const LayeredImage& picture, const std::filesystem::path& path,
               const PictureText& text) {
  base::write_file(path, exr_bytes(picture, text));
}

}  // namespace qjulia
