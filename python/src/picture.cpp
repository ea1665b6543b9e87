#include "picture.hpp"

#include <algorithm>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/picture/look.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "unlocked.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
void take_palette(Keywords& keywords, PictureOptions& options) {
  const auto given = keywords.argument("palette");
  if (!given) return;
  std::vector<std::string> words(1);
  if (py::isinstance<py::str>(given)) {
    read(given, "palette", words.front());
  } else if (py::isinstance<py::sequence>(given)) {
    words.clear();
    for (const py::handle word : given) read(word, "palette", words.emplace_back());
  } else {
    throw py::type_error("palette must be a name or a list of colours, not " + shown(given));
  }
  options.palette = palette_from(words, options.material);
}

namespace {

/// The settings of the library's table: the look first, so that others hold over it, and the
/// palette last, since it depends on the material.
void take_settings(Keywords& keywords, PictureOptions& options) {
  const PictureSetting& look = picture_setting_named("look");
  keywords.take(look, look.place(options));
  if (keywords.argument("look")) apply_look(options, options.look);
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.name != "palette" && setting.name != "look")
      keywords.take(setting, setting.place(options));
  }
  take_palette(keywords, options);
}

PictureOptions picture_options(const py::dict& given) {
  PictureOptions options;
  Keywords keywords("render", given);
  take_settings(keywords, options);
  keywords.expect_no_more();
  options.validate();
  return options;
}

/// (height, width, 3), or 4 where the picture has an alpha.
py::array array_of_image(Image image) {
  const py::ssize_t width = image.width, height = image.height;
  if (!image.deep.empty()) {
    return array_of<std::uint16_t>(std::move(image.deep),
                                   {height, width, image.alpha.empty() ? 3 : 4});
  }
  if (image.alpha.empty())
    return array_of<std::uint8_t>(std::move(image.pixels), {height, width, 3});
  std::vector<std::uint8_t> all;
  all.reserve(4 * image.alpha.size());
  for (std::size_t i = 0; i < image.alpha.size(); ++i) {
    all.insert(all.end(), {image.pixels[3 * i], image.pixels[3 * i + 1], image.pixels[3 * i + 2],
                           image.alpha[i]});
  }
  return array_of<std::uint8_t>(std::move(all), {height, width, 4});
}

py::array rendered(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                   const py::dict& given) {
  const PictureOptions options = picture_options(given);
  Image image;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { image = render(device.device, self.map, options, monitor); });
  return array_of_image(std::move(image));
}

/// The picture, and depth, normal and position of what its pixels show.
py::tuple layered(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                  const py::dict& given) {
  const PictureOptions options = picture_options(given);
  LayeredImage picture;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { picture = layered_render(device.device, self.map, options, monitor); });
  const py::ssize_t width = options.width, height = options.height;
  py::dict layers;
  layers["depth"] = array_of<float>(std::move(picture.layers.depth), {height, width});
  layers["normal"] = array_of<float>(std::move(picture.layers.normal), {height, width, 3});
  layers["position"] = array_of<float>(std::move(picture.layers.position), {height, width, 3});
  return py::make_tuple(array_of_image(std::move(picture.image)), layers);
}

py::array rendered_mesh(const TriangleMesh& mesh, const OpenDevice& device,
                        const py::object& on_progress, const py::object& framed,
                        const py::dict& given) {
  const PictureOptions options = picture_options(given);
  mesh.validate();
  Box box = mesh.box();
  if (!framed.is_none()) read(framed, "framed", box);
  Image image;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { image = render_mesh(device.device, mesh, box, options, monitor); });
  return array_of_image(std::move(image));
}

/// The PNG file of an array (height, width, 3 or 4) of bytes. @param map that it holds, or None.
py::bytes png_of(const py::object& given, const KeptMap* map) {
  const auto array = py::array::ensure(given);
  if (!array || !array.dtype().equal(py::dtype::of<std::uint8_t>())) {
    PyErr_Clear();
    throw py::type_error("image must be an array of uint8");
  }
  if (array.ndim() != 3 || (array.shape(2) != 3 && array.shape(2) != 4)) {
    throw py::value_error("image must have shape (height, width, 3) or (height, width, 4)");
  }
  constexpr py::ssize_t kMostPixels = 1 << 20;
  if (array.shape(0) > kMostPixels || array.shape(1) > kMostPixels) {
    throw py::value_error("image is too large");
  }
  const py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast> bytes(array);
  Image image{static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)), {}};
  const auto channels = static_cast<std::size_t>(array.shape(2));
  const auto count = static_cast<std::size_t>(bytes.size()) / channels;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* const pixel = bytes.data() + i * channels;
    image.pixels.insert(image.pixels.end(), pixel, pixel + 3);
    if (channels == 4) image.alpha.push_back(pixel[3]);
  }
  const std::string file = [&] {
    const Unlocked unlocked;
    return png_bytes(image, {}, Packing::small, map == nullptr ? "" : packed_map(map->map));
  }();
  return file;
}

}  // namespace

void add_pictures(py::module_& module) {
  module.def("render", &rendered);
  module.def("render_layers", &layered);
  module.def("render_mesh", &rendered_mesh);
  module.def("png", &png_of, py::arg("image"), py::arg("map") = py::none());
  module.def("looks", [] {
    py::dict all;
    for (const std::string& name : look_names()) all[py::str(name)] = look_description(name);
    return all;
  });
  module.def("picture_settings", [] {
    const PictureOptions usual;
    return described(picture_settings(), usual);
  });
}

}  // namespace qjulia::python
