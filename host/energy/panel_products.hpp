#pragma once
/// Products of panels (layout/panel_layout.h) on a device.

#include "device/context.hpp"

namespace qjulia::energy {

class PanelProducts {
 public:
  /// @param tuning that of the precision, which all buffers have.
  PanelProducts(device::Context& context, const Tuning& tuning, Precision precision)
      : context_(context),
        width_(static_cast<std::size_t>(tuning.lane_width)),
        side_(static_cast<std::size_t>(tuning.product_side)),
        precision_(precision) {}

  enum class Update { set, add };

  /// H = PᵀP or H + PᵀP, for the upper triangles of `count` order × order matrices H by rows, each
  /// with panels P of its own.
  /// @param samples in the panels.
  void operator()(const device::RealBuffer& panels, std::size_t samples, std::size_t order,
                  std::size_t count, Update update, const device::RealBuffer& matrices);

 private:
  device::Kernel kernel(const char* name) const;

  device::Context& context_;
  std::size_t width_;
  std::size_t side_;  ///< side × side work-items share panels; 1: none do
  Precision precision_;
};

}  // namespace qjulia::energy
