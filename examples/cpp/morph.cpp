// One shape becomes another, factor by factor: morph FROM TO [FACTORS [SCHEDULE [FRAMES [WIDTH]]]]
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <qjulia/qjulia.hpp>

using qjulia::Factor;

/// `others` in the order of `factors`: each gets the one of those left that is nearest and alike.
std::vector<Factor> matched(const std::vector<Factor>& factors, std::vector<Factor> others) {
  std::vector<Factor> found;
  for (const auto& factor : factors) {
    const auto nearest = std::ranges::min_element(others, {}, [&](const Factor& other) {
      return norm(other.center - factor.center) + std::abs(other.exponent - factor.exponent);
    });
    found.push_back(*nearest);
    others.erase(nearest);
  }
  return found;
}

int main(int argc, char** argv) try {
  if (argc < 3) {
    throw qjulia::InputError("usage: morph FROM TO [FACTORS [SCHEDULE [FRAMES [WIDTH]]]]");
  }
  qjulia::FitOptions options;
  options.factors = argc > 3 ? std::atoi(argv[3]) : 100;
  options.schedule = argc > 4 ? argv[4] : "tight";
  const int frames = argc > 5 ? std::atoi(argv[5]) : 5;
  qjulia::PictureOptions picture;
  picture.width = picture.height = argc > 6 ? std::atoi(argv[6]) : 240;
  const auto device = qjulia::Device::choose();
  const auto first = qjulia::fit(device, qjulia::read_mesh(argv[1]), options).map.dynamics;
  const auto map = qjulia::fit(device, qjulia::read_mesh(argv[2]), options).map;
  const auto& last = map.dynamics;
  const auto from = matched(last.factors, first.factors);

  std::vector<qjulia::Image> images;
  for (int frame = 0; frame < frames; ++frame) {
    const double t = double(frame) / std::max(1, frames - 1);
    qjulia::Map between = map;
    for (std::size_t k = 0; k < from.size(); ++k) {
      auto& [center, exponent] = between.dynamics.factors[k];
      center = (1 - t) * from[k].center + t * last.factors[k].center;
      exponent = std::lerp(from[k].exponent, last.factors[k].exponent, t);
    }
    between.dynamics.log_scale = std::lerp(first.log_scale, last.log_scale, t);
    between.dynamics.surface_level = std::lerp(first.surface_level, last.surface_level, t);
    images.push_back(qjulia::render(device, between, picture));
  }
  qjulia::write_png(qjulia::contact_sheet(images, frames), "morph.png");
  std::cout << "morph.png, " << frames << " frames\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
