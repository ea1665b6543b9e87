#pragma once
/// What the original program computed for one small map (tests/data/README.md).

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::test {

class OriginalFigures {
 public:
  OriginalFigures() {
    std::ifstream stream(std::string(QJULIA_TEST_DATA) + "/original_n1_slice0.json");
    if (!stream) throw std::runtime_error("test data are missing");
    data_ = nlohmann::json::parse(stream);
  }

  std::vector<double> numbers(const std::string& key) const {
    return data_.at(key).get<std::vector<double>>();
  }
  double number(const std::string& key) const { return data_.at(key).get<double>(); }
  const nlohmann::json& at(const std::string& key) const { return data_.at(key); }

  /// T · B⁻¹: top factors in order, then bottom factors in reverse order with negative exponents.
  Map map() const {
    Map map;
    map.dynamics.log_scale = number("logExpScaling");
    const auto top = numbers("topPowers");
    for (std::size_t k = 0; k < top.size(); ++k) {
      map.dynamics.factors.push_back({center("topRoots", k), number("topPowerScalar") * top[k]});
    }
    const auto bottom = numbers("bottomPowers");
    for (std::size_t k = bottom.size(); k-- > 0;) {
      map.dynamics.factors.push_back(
          {center("bottomRoots", k), -number("bottomPowerScalar") * bottom[k]});
    }
    return map;
  }

 private:
  Quaternion center(const char* list, std::size_t k) const {
    const auto c = data_.at(list).at(k).get<std::vector<double>>();
    return {c[0], c[1], c[2], c[3]};
  }

  nlohmann::json data_;
};

}  // namespace qjulia::test
