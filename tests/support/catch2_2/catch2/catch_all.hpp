#pragma once
/// Catch2 3 where there is Catch2 2, such as in Debian 12: the names of version 3 that tests use.

#include <catch2/catch.hpp>

namespace Catch {

using Detail::Approx;

namespace Matchers {

inline auto ContainsSubstring(const std::string& part) { return Contains(part); }

}  // namespace Matchers
}  // namespace Catch
