/// qjulia_plot_fits PICTURE.png FIT.json…: 1 − IoU against seconds, from what 'qjulia fit --json'
/// printed; a line a fit, labelled by its file's name. For tools/experiments/fit-curves.

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"
#include "report/plot.hpp"

namespace {

using qjulia::report::PlotSeries;

PlotSeries curve(const std::filesystem::path& path) {
  std::ifstream file(path);
  const auto fit = nlohmann::json::parse(file, nullptr, false);
  if (!fit.is_object() || !fit.contains("stages")) {
    throw qjulia::InputError(fmt::format("'{}' is not the JSON of a fit", path.string()));
  }
  PlotSeries series;
  series.label = path.stem().string();
  double in_stages = 0;
  for (const auto& stage : fit["stages"]) in_stages += stage["seconds"].get<double>();
  // Stages begin when mesh and placement are done; little time passes after them.
  double seconds = fit["seconds"].get<double>() - in_stages;
  for (const auto& stage : fit["stages"]) {
    seconds += stage["seconds"].get<double>();
    series.x.push_back(seconds);
    series.y.push_back(1 - stage["iou"].get<double>());
  }
  return series;
}

}  // namespace

int main(int count, char** words) {
  try {
    if (count < 3) throw qjulia::InputError("usage: qjulia_plot_fits PICTURE.png FIT.json…");
    if (qjulia::base::extension_of(words[1]) != ".png") {
      throw qjulia::InputError(fmt::format("'{}' must end in .png", words[1]));
    }
    qjulia::report::Plot plot;
    plot.title = "What is missing of an IoU of 1, by the time of the fit";
    plot.x.label = "seconds";
    plot.y.label = "1 - IoU, n = 1";
    plot.y.logarithmic = true;
    for (int i = 2; i < count; ++i) plot.series.push_back(curve(words[i]));
    qjulia::write_png(qjulia::report::draw_plot(plot), words[1]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "qjulia_plot_fits: {}\n", error.what());
    return 1;
  }
}
