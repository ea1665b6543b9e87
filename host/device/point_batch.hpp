#pragma once
/// Kernels over many points, in launches of about 80 ms each: short enough for a display's watchdog
/// and for a stop request, long enough to cost nothing. How much work that is, the context learns
/// from the launches of the kernel before. No result depends on where launches are cut. A device
/// that has no room for a part gets smaller ones.

#include <algorithm>
#include <array>
#include <span>
#include <stop_token>
#include <utility>
#include <vector>

#include "device/context.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::device {

/// What a part is launched with.
struct PartCall {
  std::vector<Argument> arguments;
  LaunchWork work;
};

/// Launches `kernel` over `items` work-items in parts. `call(first, count)` gives the PartCall of
/// the part that begins with item `first`; the buffers in its arguments must outlive the call.
/// @param cost of an item, in a unit that is the kernel's own, such as pairs of a point and a
/// factor.
template <class Call>
void launch_in_parts(Context& context, const Kernel& kernel, std::size_t items, double cost,
                     const Call& call) {
  std::size_t most = items;
  for (std::size_t first = 0; first < items;) {
    const std::size_t part =
        std::min({items - first, most, context.items_per_launch(kernel, cost)});
    const PartCall made = call(first, part);
    try {
      context.launch(kernel, {{part, 1, 1}}, std::span(made.arguments), made.work,
                     cost * static_cast<double>(part));
    } catch (const RefusedLaunch& refused) {
      if (!is_out_of_resources(refused) || part == 1) throw;
      context.finish();
      most = part / 2;
      continue;
    }
    first += part;
  }
}

/// One kernel over points that come from the host: pads them to whole work-items by repeating the
/// last, uploads them, launches, and reads back what the kernel makes of them.
class PointBatch {
 public:
  /// @param cost of a point, as above.
  PointBatch(Context& context, Kernel kernel, Precision precision, std::size_t points_per_item,
             double cost)
      : context_(context),
        kernel_(std::move(kernel)),
        precision_(precision),
        points_per_item_(points_per_item),
        cost_(cost) {}

  /// One launch: points `first` … `first + count − 1`, in `items` work-items.
  struct Part {
    std::size_t first, count, items;
    std::size_t stride;  ///< reals in an array of `in` and of `out`: a multiple of an item's points
    const RealBuffer& in;   ///< kInputs arrays
    const RealBuffer& out;  ///< kOutputs arrays
  };

  /// For kernels that make the points' coordinates themselves.
  struct NoInputs {};

  /// @param coordinates (i) → the kInputs reals of point i; NoInputs where there are none.
  /// @param call (part) → the launch's PartCall.
  /// @param take (i, reals) gets the kOutputs reals of point i, in the points' order.
  /// @param group work-items of a work-group; 0: the device's own choice.
  /// @param stop ends it between launches.
  template <std::size_t kInputs, std::size_t kOutputs, class Coordinates, class Call, class Take>
  void run(std::size_t points, const Coordinates& coordinates, const Call& call, const Take& take,
           std::size_t group = 0, const std::stop_token& stop = {}) {
    Buffers buffers;
    // Fewer where the device has no room for as many. Nothing is taken before all of a part is
    // read.
    std::size_t most = std::max<std::size_t>(1, kMostPoints / points_per_item_);
    for (std::size_t first = 0; first < points;) {
      throw_if_stopped(stop);
      const std::size_t items = std::min(most, context_.items_per_launch(kernel_, item_cost()));
      const std::size_t count = std::min(points - first, items * points_per_item_);
      try {
        run_part<kInputs, kOutputs>(buffers, first, count, coordinates, call, group);
      } catch (const DeviceError& error) {
        const std::size_t taken = (count + points_per_item_ - 1) / points_per_item_;
        if (!is_out_of_resources(error) || taken == 1) throw;
        context_.finish();
        buffers = {};
        most = taken / 2;
        continue;
      }
      const std::size_t stride = buffers.found.size() / kOutputs;
      for (std::size_t i = 0; i < count; ++i) {
        std::array<double, kOutputs> reals{};
        for (std::size_t c = 0; c < kOutputs; ++c) reals[c] = buffers.found[c * stride + i];
        take(first + i, reals);
      }
      first += count;
    }
  }

 private:
  /// In a launch, for memory's sake.
  static constexpr std::size_t kMostPoints = std::size_t{1} << 20;

  struct Buffers {
    std::vector<double> sent, found;
    RealBuffer in, out;
  };

  double item_cost() const { return cost_ * static_cast<double>(points_per_item_); }

  /// Leaves kOutputs arrays in `buffers.found`.
  template <std::size_t kInputs, std::size_t kOutputs, class Coordinates, class Call>
  void run_part(Buffers& buffers, std::size_t first, std::size_t count,
                const Coordinates& coordinates, const Call& call, std::size_t group) {
    auto& [sent, found, in, out] = buffers;
    const std::size_t items = (count + points_per_item_ - 1) / points_per_item_;
    const std::size_t stride = items * points_per_item_;
    sent.resize(kInputs * stride);
    if constexpr (kInputs > 0) {
      for (std::size_t i = 0; i < stride; ++i) {
        const std::array<double, kInputs> reals = coordinates(first + std::min(i, count - 1));
        for (std::size_t c = 0; c < kInputs; ++c) sent[c * stride + i] = reals[c];
      }
    }
    if (in.size() < kInputs * stride) in = context_.allocate_real(kInputs * stride, precision_);
    if (out.size() < kOutputs * stride) out = context_.allocate_real(kOutputs * stride, precision_);
    context_.write(in, sent);
    Range range{{items, 1, 1}, {}};
    if (group > 0) range = {{(items + group - 1) / group * group, 1, 1}, {group, 1, 1}};
    const PartCall made = call(Part{first, count, items, stride, in, out});
    context_.launch(kernel_, range, std::span(made.arguments), made.work,
                    item_cost() * static_cast<double>(items));
    found.resize(kOutputs * stride);
    context_.read(out, std::span(found).first(kOutputs == 1 ? count : kOutputs * stride));
  }

  Context& context_;
  Kernel kernel_;
  Precision precision_;
  std::size_t points_per_item_;
  double cost_;
};

}  // namespace qjulia::device
