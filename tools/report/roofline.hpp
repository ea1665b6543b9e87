#pragma once
/// The roofline picture: kernels between what memory and what arithmetic allow.

#include "qjulia/profile/profile.hpp"
#include "report/plot.hpp"

namespace qjulia::report {

/// After Williams, Waterman and Patterson, "Roofline", Communications of the ACM 52(4), 2009: work
/// per byte across, work per second up, both logarithmic. A kernel lies as far below the roof as
/// the share that it reached says. Kernels whose work is not known or whose share cannot be judged
/// are left out.
Plot roofline(const ProfileReport& report);

}  // namespace qjulia::report
