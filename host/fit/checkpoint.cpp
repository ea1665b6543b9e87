#include "fit/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string_view>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "base/setting_json.hpp"
#include "fit/sample_weights.hpp"
#include "fit/schedule.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::fitting {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "qjulia-checkpoint";

/// A checkpoint begins with a checksum of so many digits, which shows whether the rest is intact.
constexpr std::size_t kDigits = 16;
std::string digits_of(std::string_view content) {
  base::FnvHash hash;
  hash.add(content);
  return hash.text();
}

json to_json(const StageReport& r) {
  return json::array(
      {r.name, r.evaluations, r.energy_before, r.energy_after, r.seconds, r.iou, r.iterations});
}

StageReport report_from(const json& j) {
  return {j.at(0), j.at(1), j.at(2), j.at(3), j.at(4), j.at(5), j.at(6)};
}

/// The weights, and of each block its factors and the lower triangle of its matrix, by columns.
json to_json(const CurvatureSum& curvature) {
  json blocks = json::array();
  for (std::size_t b = 0; b < curvature.sum.blocks.size(); ++b) {
    const Eigen::MatrixXd& own = curvature.sum.own[b];
    std::vector<double> lower;
    for (Eigen::Index j = 0; j < own.cols(); ++j) {
      const auto column = own.col(j).tail(own.rows() - j);
      lower.insert(lower.end(), column.begin(), column.end());
    }
    blocks.push_back(json::array({curvature.sum.blocks[b], std::move(lower)}));
  }
  const Eigen::VectorXd& weight = curvature.weight;
  return json::array({std::vector<double>(weight.begin(), weight.end()), std::move(blocks)});
}

/// A sum over the blocks of a map with so many factors, or an empty one; nothing where that is not
/// what is there.
std::optional<CurvatureSum> curvature_from(const json& j, std::size_t factors) {
  CurvatureSum curvature;
  const std::vector<double> weight = j.at(0);
  curvature.weight =
      Eigen::Map<const Eigen::VectorXd>(weight.data(), static_cast<Eigen::Index>(weight.size()));
  std::vector<std::size_t> seen;
  for (const json& block : j.at(1)) {
    const std::vector<std::size_t>& members = curvature.sum.blocks.emplace_back(block.at(0));
    if (!std::ranges::is_sorted(members)) return std::nullopt;
    seen.insert(seen.end(), members.begin(), members.end());
    const auto entries = block.at(1).get<std::vector<double>>();
    const std::size_t order = 5 * members.size();
    if (entries.size() != order * (order + 1) / 2) return std::nullopt;
    const auto n = static_cast<Eigen::Index>(order);
    Eigen::MatrixXd lower = Eigen::MatrixXd::Zero(n, n);
    auto next = entries.begin();
    for (Eigen::Index k = 0; k < n; ++k) {
      std::copy_n(next, n - k, lower.col(k).tail(n - k).begin());
      next += n - k;
    }
    curvature.sum.own.emplace_back(lower.selfadjointView<Eigen::Lower>());
  }
  if (seen.empty() && weight.empty()) return curvature;
  std::vector<std::size_t> all(factors);
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::ranges::sort(seen);
  if (seen != all || weight.size() != factors) return std::nullopt;
  return curvature;
}

}  // namespace

std::string fit_key(const TriangleMesh& mesh, const FitOptions& options, const Device& device) {
  base::FnvHash hash;
  for (const auto& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) hash.add(v[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    for (const auto vertex : triangle) hash.add(vertex);
  }
  base::FnvHash schedule_hash;
  schedule_hash.add(text_of_schedule(options));
  base::FnvHash initial_hash;
  if (options.initial) initial_hash.add(to_json(*options.initial).dump());
  base::FnvHash weights_hash;
  if (options.weights) {
    for (const double weight : weights_at(options.weights, mesh.vertices)) weights_hash.add(weight);
  }
  nlohmann::json settings = nlohmann::json::object();
  for (const FitSetting& setting : fit_settings()) {
    if (setting.may_differ_on_resume) continue;
    FitOptions read = options;
    settings[setting.name] = base::value_json(setting, setting.place(read));
  }
  return fmt::format("{} {} {} {} {} {} {} {} {} {}", version(), hash.text(), settings.dump(),
                     schedule_hash.text(), initial_hash.text(), weights_hash.text(),
                     device.info().name, device.info().driver_version, to_string(device.layout()),
                     to_json(device.tuning(options.precision)).dump());
}

Checkpoint::Checkpoint(std::filesystem::path path, std::string key, double interval,
                       std::function<void(const std::string&)> warn)
    : path_(std::move(path)), key_(std::move(key)), interval_(interval), warn_(std::move(warn)) {}

InputError Checkpoint::problem_with_file(const char* what) const {
  return InputError(
      fmt::format("checkpoint '{}' {}; remove it to start afresh", path_.string(), what));
}

std::string Checkpoint::read() const {
  constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 30;
  std::error_code ignored;
  std::string bytes;
  if (std::filesystem::is_regular_file(path_, ignored)) {
    base::InputFile(path_, "checkpoint", kLargestFile).read_all(bytes);
  }
  if (bytes.empty()) return {};
  std::string content = bytes.substr(std::min(kDigits, bytes.size()));
  if (!bytes.starts_with(digits_of(content))) throw problem_with_file("is damaged");
  const json j = json::from_cbor(content, true, false);
  if (!j.is_object() || j.value("format", "") != kFormat) throw problem_with_file("is damaged");
  if (j.value("key", "") != key_) {
    throw problem_with_file("belongs to a fit with another mesh, other options, or another device");
  }
  return content;
}

std::optional<FitState> Checkpoint::state_in(const std::string& content) const {
  if (content.empty()) return std::nullopt;
  FitState state;
  try {
    const json j = json::from_cbor(content);
    state.map = map_from_json(j.at("map"), path_.string());
    state.random = j.at("random");
    state.level = j.at("level");
    state.planned = j.at("planned");
    state.evaluations = j.at("evaluations");
    state.most_triangles = j.at("most_triangles");
    state.seconds = j.at("seconds");
    for (const json& report : j.at("reports")) state.reports.push_back(report_from(report));
    auto curvature = curvature_from(j.at("curvature"), state.map.dynamics.factors.size());
    if (!curvature) throw problem_with_file("is damaged");
    state.curvature = *std::move(curvature);
    for (const json& e : j.at("evaluated")) {
      state.evaluated.push_back({e.at(0), e.at(1).get<std::vector<double>>()});
    }
  } catch (const json::exception&) {
    throw problem_with_file("is damaged");
  }
  return state;
}

void Checkpoint::save(const FitState& state) {
  if (path_.empty()) return;
  json reports = json::array(), evaluated = json::array();
  for (const StageReport& report : state.reports) reports.push_back(to_json(report));
  for (const Evaluation& e : state.evaluated) {
    evaluated.push_back(json::array({e.energy, e.gradient}));
  }
  const auto bytes = json::to_cbor({{"format", kFormat},
                                    {"key", key_},
                                    {"map", to_json(state.map)},
                                    {"random", state.random},
                                    {"level", state.level},
                                    {"planned", state.planned},
                                    {"evaluations", state.evaluations},
                                    {"most_triangles", state.most_triangles},
                                    {"seconds", state.seconds},
                                    {"reports", std::move(reports)},
                                    {"curvature", to_json(state.curvature)},
                                    {"evaluated", std::move(evaluated)}});
  try {
    const std::string_view content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    base::write_file(path_, digits_of(content) + std::string(content));
  } catch (const OutputError& error) {
    if (problem_.empty()) {
      problem_ = fmt::format("the fit cannot be kept while it is under way: {}", error.what());
      if (warn_) warn_(problem_);
    }
  }
  saved_ = Clock::now();
}

bool Checkpoint::due() const {
  return !path_.empty() &&
         std::chrono::duration<double>(Clock::now() - saved_).count() >= interval_;
}

}  // namespace qjulia::fitting
