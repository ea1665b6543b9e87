#include "report/report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "base/base64.hpp"
#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"
#include "report/html.hpp"
#include "report/plot.hpp"

namespace qjulia::report {
namespace {

constexpr int kIterations = 6;  ///< n of the set's picture and figures

/// A figure of the stages against the evaluations or the seconds up to their ends.
std::string curve(const std::vector<StageReport>& stages, const char* label, bool by_seconds,
                  double StageReport::*value, bool logarithmic) {
  Plot plot;
  plot.width = 480;
  plot.height = 300;
  PlotSeries& series = plot.series.emplace_back();
  series.points = true;
  double at = 0;
  for (const StageReport& stage : stages) {
    at += by_seconds ? stage.seconds : stage.evaluations;
    series.x.push_back(at);
    series.y.push_back(stage.*value);
  }
  plot.x.label = by_seconds ? "seconds in stages" : "evaluations";
  plot.y.label = label;
  plot.y.logarithmic = logarithmic;
  // As a picture of its own: names inside a plot are those of every other plot.
  return fmt::format(
      "<figure><img alt=\"{} against {}\" src=\"data:image/svg+xml;base64,{}\"/></figure>\n",
      html::escaped(label), plot.x.label, base::base64(plot_svg(plot)));
}

std::string curves(const std::vector<StageReport>& stages) {
  if (stages.empty()) return "<p>No stage was run.</p>\n";
  std::string text = "<div class=\"row\">\n";
  for (const bool by_seconds : {false, true}) {
    text += curve(stages, "energy", by_seconds, &StageReport::energy_after, true);
    text += curve(stages, "IoU, 48 cells", by_seconds, &StageReport::iou, false);
  }
  return text + "</div>\n";
}

std::string stage_table(const std::vector<StageReport>& stages) {
  std::vector<std::vector<std::string>> rows;
  rows.reserve(stages.size());
  for (const StageReport& s : stages) {
    rows.push_back({s.name, fmt::format("{}", s.evaluations),
                    fmt::format("{:.4g}", s.energy_before), fmt::format("{:.4g}", s.energy_after),
                    fmt::format("{:.4f}", s.iou), fmt::format("{:.2f}", s.seconds)});
  }
  return html::table({"stage", "evaluations", "energy before", "after", "IoU", "seconds"}, rows);
}

std::string figure(double value, int digits) {
  return std::isnan(value) ? "undefined" : fmt::format("{:.{}f}", value, digits);
}

std::string signed_figure(double value, int digits) {
  return std::isnan(value) ? "undefined" : fmt::format("{:+.{}f}", value, digits);
}

std::string metrics_table(const std::vector<FitMetrics>& all) {
  std::vector<std::vector<std::string>> rows;
  std::string notes;
  rows.reserve(all.size());
  for (const FitMetrics& m : all) {
    rows.push_back({fmt::format("{}", m.iterations), figure(m.iou, 4),
                    figure(100 * m.mean_distance, 3), figure(100 * m.distance_95, 3),
                    figure(100 * m.hausdorff_distance, 2), figure(m.roughness, 3),
                    signed_figure(m.energy, 4), figure(m.slope_variation, 3)});
    const std::string why = why_undefined(m);
    if (!why.empty())
      notes += fmt::format("<p>Undefined at n = {}: {}.</p>\n", m.iterations, html::escaped(why));
  }
  return html::table({"n", "IoU", "mean distance, % of diagonal", "95 % within, %", "Hausdorff, %",
                      "roughness", "energy", "variation of slope"},
                     rows) +
         notes;
}

}  // namespace

FitReport make_report(const Device& device, const TriangleMesh& mesh, const FitResult& result,
                      const std::string& title, const ProgressMonitor& monitor) {
  FitReport report{title, result, {}, {}};
  PictureOptions picture;
  picture.width = 480;
  picture.height = 360;
  picture.camera.up = result.map.frame.up.value_or(kDefaultUp);  // the mesh stands so too
  const auto add = [&](const std::string& caption, Image image) {
    report.pictures.push_back({caption, std::move(image)});
  };
  Studio original(device, mesh, mesh.box(), picture);
  picture.camera = original.aimed(std::span(&picture.camera, 1)).front();  // one for all
  add("the mesh", original.picture(picture.camera, monitor));
  picture.iterations = 1;
  add("the potential, n = 1", render(device, result.map, picture, monitor));
  picture.iterations = kIterations;
  Image set = render(device, result.map, picture, monitor);
  const std::size_t loose = set.loose.count;
  add(fmt::format("the set, n = {}{}", kIterations,
                  loose == 0   ? ""
                  : loose == 1 ? ", without a loose piece"
                               : fmt::format(", without {} loose pieces", loose)),
      std::move(set));
  CompareOptions comparison;
  comparison.iterations = kIterations;
  report.metrics = compare(device, result.map, mesh, comparison, monitor);
  return report;
}

std::string report_html(const FitReport& report) {
  std::string body =
      fmt::format("<p>{} factors, {} evaluations in {:.1f} s; ended: {}.</p>\n",
                  report.result.map.dynamics.factors.size(), report.result.evaluations,
                  report.result.seconds, to_string(report.result.stopped));
  for (const std::string& warning : report.result.warnings) {
    body += "<p><strong>Warning:</strong> " + html::escaped(warning) + "</p>\n";
  }
  body += "<h2>Pictures</h2>\n<div class=\"row\">\n";
  for (const auto& [caption, image] : report.pictures) body += html::figure(image, caption);
  body += "</div>\n<h2>How well it fits</h2>\n" + metrics_table(report.metrics);
  body +=
      "<h2>How it went</h2>\n" + curves(report.result.stages) + stage_table(report.result.stages);
  const auto text = report.result.map.provenance.json().dump(
      2, ' ', true, nlohmann::json::error_handler_t::replace);
  body += "<h2>How it was made</h2>\n<pre>" + html::escaped(text) + "</pre>\n";
  return html::page(report.title, body);
}

void write_report(const FitReport& report, const std::filesystem::path& file) {
  std::error_code error;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
  if (error) {
    throw OutputError(
        fmt::format("cannot make folder '{}': {}", file.parent_path().string(), error.message()));
  }
  base::write_file(file, report_html(report));
}

}  // namespace qjulia::report
