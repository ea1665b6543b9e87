#include "energy/panel_products.hpp"

namespace qjulia::energy {

device::Kernel PanelProducts::kernel(const char* name) const {
  return context_.kernel("gauss_newton.cl", name, {static_cast<int>(width_), precision_, {}});
}

void PanelProducts::operator()(const device::RealBuffer& panels, std::size_t samples,
                               std::size_t order, std::size_t count, Update update,
                               const device::RealBuffer& matrices) {
  // The upper triangles of PᵀP.
  const auto matrices_count = static_cast<double>(count), rows = static_cast<double>(samples),
             side = static_cast<double>(order);
  const device::LaunchWork work{matrices_count * rows * side * (side + 1) / 2,
                                matrices_count * (rows * side + side * (side + 1)),
                                false,
                                {count, order, "unknowns", samples}};
  const auto launch = [&](const device::Kernel& products, const device::Range& range) {
    context_.launch(products, range,
                    {panels, device::narrow(samples), device::narrow(order),
                     update == Update::set ? 0 : 1, matrices},
                    work);
  };
  // Work-items share tiles as the settings say, unless the device takes no groups of as many.
  if (side_ > 1) {
    constexpr std::size_t kTile = 64;  // entries of the matrix along a group's side
    const std::size_t items = (order + kTile - 1) / kTile * side_;
    const auto products = kernel("panel_products_shared");
    try {
      if (context_.largest_group(products) >= side_ * side_) {
        launch(products, {{items, items, count}, {side_, side_, 1}});
        return;
      }
    } catch (const DeviceError& error) {
      if (!device::is_refused_group(error)) throw;
    }
    side_ = 1;
  }
  launch(kernel("panel_products"), {{order / 8, order / (2 * width_), count}, {}});
}

}  // namespace qjulia::energy
