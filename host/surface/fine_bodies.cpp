#include "surface/fine_bodies.hpp"

#include <map>
#include <utility>

namespace qjulia::surface {
namespace {

/// About as many points are asked about together, for memory's sake.
constexpr std::size_t kPlacesAtOnce = std::size_t{1} << 17;

}  // namespace

using Index = Eigen::Vector3i;

FineBodies::FineBodies(const Grid& coarse, const std::vector<bool>& is_kept, int divisions,
                       Links links, const Insides& insides)
    : coarse_points_(coarse.points),
      is_kept_(is_kept),
      block_{Index::Zero(), Index::Constant(divisions)},
      links_(links),
      insides_(insides),
      fine_{coarse.origin, coarse.step / divisions, divisions * coarse.points},
      slots_(whole(coarse).size(), kUnknown) {}

std::size_t FineBodies::place(const Index& at) const {
  if (!is_on_grid(at)) return kNowhere;
  const Index cell = at / block_.count.x();
  const std::int32_t slot = slots_[number_of(cell, coarse_points_)];
  if (slot < 0) return kNowhere;
  return static_cast<std::size_t>(slot) * block_.size() +
         number_of(at - block_.count.x() * cell, block_.count);
}

void FineBodies::want(const Index& middle, int reach) {
  const int divisions = block_.count.x();
  const Index low = (middle.array() - reach).max(0) / divisions;
  const Index high = (middle.array() + reach).min(fine_.points.array() - 1) / divisions;
  for_points(high - low + Index::Ones(), [&](std::size_t, const Index& by) {
    const std::size_t block = number_of(low + by, coarse_points_);
    if (slots_[block] != kUnknown) return;
    slots_[block] = kWanted;
    wanted_.push_back(block);
  });
}

bool FineBodies::look() {
  if (wanted_.empty()) return false;
  std::vector<Eigen::Vector3d> points;
  const auto ask = [&] {
    const std::vector<bool> found = insides_(points);
    inside_.insert(inside_.end(), found.begin(), found.end());
    points.clear();
  };
  for (const std::size_t block : wanted_) {
    slots_[block] = static_cast<std::int32_t>(blocks_.size());
    blocks_.push_back(block);
    const Index lower = block_.count.x() * index_of(block, coarse_points_);
    for_points(block_.count, [&](std::size_t, const Index& in_block) {
      points.push_back(fine_.point(lower + in_block));
      bodies_.add();
    });
    if (points.size() >= kPlacesAtOnce) ask();
  }
  if (!points.empty()) ask();
  wanted_.clear();
  return true;
}

void FineBodies::unite_from(std::size_t first_block) {
  for_inside(first_block, [&](std::size_t place, const Index& at) {
    const auto element = static_cast<std::uint32_t>(place + 1);
    for_next(at, [&](const Index& next) {
      const std::size_t other = this->place(next);
      if (other == kNowhere || !inside_[other]) return;
      bodies_.unite(element, static_cast<std::uint32_t>(other + 1));
    });
    const std::size_t block = blocks_[place / block_.size()];
    const bool is_corner = place % block_.size() == 0;
    if (is_corner && is_kept_[block]) bodies_.unite(element, kKept);
  });
}

void FineBodies::follow(int rounds) {
  for (int round = 0; round < rounds; ++round) {
    const std::size_t known = blocks_.size();
    if (!look()) return;
    unite_from(known);
    for_inside(known, [&](std::size_t place, const Index& at) {
      if (body_of(place) == bodies_.root(kKept)) return;
      for_next(at, [&](const Index& next) { want(next, 0); });
    });
  }
}

void FineBodies::look_around_loose(int reach) {
  for_inside(0, [&](std::size_t place, const Index& at) {
    if (loose_[place]) want(at, reach);
  });
  const std::size_t known = blocks_.size();
  if (look()) unite_from(known);
}

void FineBodies::find_loose(double points) {
  const std::uint32_t kept = bodies_.root(kKept);
  std::vector<std::uint32_t> sizes(bodies_.size());
  std::vector<bool> goes_on(bodies_.size());
  for_inside(0, [&](std::size_t place, const Index& at) {
    const std::uint32_t body = body_of(place);
    ++sizes[body];
    if (body == kept || goes_on[body]) return;
    for_next(at, [&](const Index& next) {
      if (this->place(next) == kNowhere) goes_on[body] = true;
    });
  });
  loose_.assign(inside_.size(), false);
  for_inside(0, [&](std::size_t place, const Index&) {
    const std::uint32_t body = body_of(place);
    loose_[place] = body != kept && !goes_on[body] && sizes[body] < points;
  });
}

std::vector<std::vector<std::size_t>> FineBodies::loose_bodies() {
  std::vector<std::vector<std::size_t>> found;
  std::map<std::uint32_t, std::size_t> numbers;
  for (std::size_t place = 0; place < loose_.size(); ++place) {
    if (!loose_[place]) continue;
    const auto [body, is_new] = numbers.emplace(body_of(place), found.size());
    if (is_new) found.emplace_back();
    found[body->second].push_back(place);
  }
  return found;
}

}  // namespace qjulia::surface
