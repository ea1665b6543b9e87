#pragma once
/// The names of Catch2 3 that tests use, defined for Catch2 2, which Debian 12 has.

#include <catch2/catch.hpp>

namespace Catch {

using Detail::Approx;

namespace Matchers {

inline auto ContainsSubstring(const std::string& part) { return Contains(part); }

}  // namespace Matchers
}  // namespace Catch
