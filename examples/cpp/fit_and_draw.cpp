// Fits a map to a mesh, and draws it: fit_and_draw MESH [FACTORS [SCHEDULE [WIDTH]]]
#include <cstdlib>
#include <iostream>
#include <qjulia/qjulia.hpp>

int main(int argc, char** argv) try {
  if (argc < 2) throw qjulia::InputError("usage: fit_and_draw MESH [FACTORS [SCHEDULE [WIDTH]]]");
  const auto device = qjulia::Device::choose();
  const auto mesh = qjulia::read_mesh(argv[1]);

  qjulia::FitOptions options;
  options.factors = argc > 2 ? std::atoi(argv[2]) : 200;
  options.schedule = argc > 3 ? argv[3] : "tight";
  options.observer.on_stage = [](const qjulia::StageReport& stage, const qjulia::Map&) {
    std::cout << stage.name << ": energy " << stage.energy_after << ", IoU " << stage.iou << '\n';
  };
  const auto result = qjulia::fit(device, mesh, options);
  std::cout << qjulia::brief_summary(result) << '\n';
  qjulia::write_map(result.map, "shape.qjulia.json");

  qjulia::PictureOptions picture;
  picture.width = argc > 4 ? std::atoi(argv[4]) : 640;
  picture.height = picture.width * 3 / 4;
  picture.camera.azimuth = 40;
  qjulia::write_png(qjulia::render(device, result.map, picture), "shape.png");

  const auto surface =
      qjulia::extract_surface(device, result.map, {.resolution = picture.width / 4});
  qjulia::write_mesh(surface, "shape.ply");
  std::cout << "shape.png, shape.ply with " << surface.triangles.size()
            << " triangles, shape.qjulia.json\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
