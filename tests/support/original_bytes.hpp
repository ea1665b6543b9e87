#pragma once
/// Writes .o3d files from the description of their format (docs/reference/map-format.md).

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "qjulia/base/quaternion.hpp"

namespace qjulia::test {

class Bytes {
 public:
  Bytes& integer(std::int32_t value) { return put(value); }
  Bytes& number(double value) { return put(value); }
  Bytes& numbers(const std::vector<double>& values) {
    for (const double v : values) number(v);
    return *this;
  }
  Bytes& quaternions(const std::vector<Quaternion>& list) {
    integer(static_cast<std::int32_t>(list.size()));
    for (const Quaternion& q : list) numbers({q.x, q.y, q.z, q.w});
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  template <class T>
  Bytes& put(T value) {
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof(T));
    text_.append(bytes.data(), bytes.size());
    return *this;
  }

  std::string text_;
};

struct OriginalPolynomial {
  std::vector<Quaternion> roots;
  std::vector<double> powers;
  double power_scalar = 1;
};

struct OriginalFile {
  OriginalPolynomial top;
  OriginalPolynomial bottom;
  double scaling = 1;
};

inline void put(Bytes& bytes, const OriginalPolynomial& p) {
  const std::size_t n = p.roots.size();
  bytes.integer(static_cast<std::int32_t>(n));
  // What the original derives from the roots, and no reader of maps needs.
  for (const std::size_t count : {n + 1, n, n - 1}) {
    bytes.quaternions(std::vector<Quaternion>(count, Quaternion{7, 7, 7, 7}));
  }
  bytes.quaternions(p.roots);
  bytes.integer(static_cast<std::int32_t>(p.powers.size())).numbers(p.powers);
  bytes.number(p.power_scalar);
}

inline std::string original_bytes(const OriginalFile& file) {
  Bytes bytes;
  bytes.integer(2).integer(3).integer(4).numbers({0.1, 0.2, 0.3}).numbers({3, 3.5, 4});
  put(bytes, file.top);
  put(bytes, file.bottom);
  bytes.number(file.scaling).integer(0);
  for (int field = 0; field < 3; ++field) {
    bytes.integer(2).integer(3).integer(4).numbers({0.1, 0.2, 0.3}).numbers({3, 3.5, 4});
    bytes.numbers(std::vector<double>(24, 0.5));
  }
  return bytes.text();
}

/// Three roots and two poles.
inline OriginalFile small_original() {
  return {{{{0, 0, 0, 0}, {0.1, -0.2, 0.3, 0}, {1.0 / 3, 0.7, -0.9, 0.05}}, {1.5, 0.7, 2.25}, 1.25},
          {{{0.9, 0.8, 0.7, 0}, {-1.1, 0.3, 0.2, -0.01}}, {0.4, 0.6}, 0.5},
          1.7};
}

}  // namespace qjulia::test
