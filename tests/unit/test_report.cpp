// The page of a fit.

#include <catch2/catch_all.hpp>
#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"
#include "report/html.hpp"
#include "report/report.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Elements that were opened and not closed, or closed without having been opened; 0 in XML.
int unbalanced(const std::string& page) {
  std::vector<std::string> open;
  int wrong = 0;
  for (auto at = page.find('<'); at != std::string::npos; at = page.find('<', at + 1)) {
    const std::string tag = page.substr(at + 1, page.find('>', at) - at - 1);
    const bool closes = tag.front() == '/';
    const std::string name =
        tag.substr(closes ? 1 : 0, tag.find_first_of(" /", 1) - (closes ? 1 : 0));
    if (!closes) {
      if (tag.back() != '/') open.push_back(name);
    } else if (open.empty() || open.back() != name) {
      ++wrong;
    } else {
      open.pop_back();
    }
  }
  return wrong + static_cast<int>(open.size());
}

report::FitReport some_report() {
  report::FitReport report;
  report.title = "a<b> & \"c\" \xff";
  report.result.map.dynamics.factors = {{{0, 0, 0, 0}, 2}};
  report.result.map.provenance = nlohmann::json{{"mesh", "x.obj"}, {"options", {{"seed", 7}}}};
  report.result.evaluations = 123;
  report.result.stages = {{"wide band", 60, 0.5, 0.1, 2, 0.9}, {"band", 63, 0.2, 0.05, 3, 0.95}};
  report.result.warnings = {"thin <parts>"};
  report.pictures = {{"the mesh", {2, 1, {1, 2, 3, 4, 5, 6}}}, {"the set", {1, 1, {9, 9, 9}}}};
  FitMetrics metrics;
  metrics.iou = 0.9876;
  report.metrics = {metrics};
  return report;
}

}  // namespace

TEST_CASE("text in a page is escaped, whatever its bytes") {
  CHECK(html::escaped("a<b> & \"c\"") == "a&lt;b&gt; &amp; &quot;c&quot;");
  CHECK(html::escaped("\xc3\xa9") == "\xc3\xa9");
  CHECK(html::escaped("\xff\x01") == "\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK(html::table({"h"}, {{"<1>"}}) ==
        "<table>\n<tr><th>h</th></tr>\n<tr><td>&lt;1&gt;</td></tr>\n</table>\n");
}

TEST_CASE("a report holds all its parts and nothing from elsewhere") {
  const std::string page = report::report_html(some_report());
  CHECK(unbalanced(page.substr(page.find('\n'))) == 0);
  CHECK_THAT(page, ContainsSubstring("<title>a&lt;b&gt; &amp; &quot;c&quot; \xEF\xBF\xBD</title>"));
  CHECK_THAT(page, ContainsSubstring("123 evaluations") && ContainsSubstring("thin &lt;parts&gt;"));
  CHECK_THAT(page, ContainsSubstring("0.9876") && ContainsSubstring("wide band") &&
                       ContainsSubstring("&quot;seed&quot;: 7"));
  const auto count = [&page](const std::string& part) {
    int found = 0;
    for (auto at = page.find(part); at != std::string::npos; at = page.find(part, at + 1)) ++found;
    return found;
  };
  CHECK(count("src=\"data:image/png;base64,") == 2);
  CHECK(count("src=\"data:image/svg+xml;base64,") == 4);
  CHECK(count("src=") == 6);
  CHECK(count("http://www.w3.org") >= 1);
  CHECK(count("://") == count("http://www.w3.org"));
  CHECK(count("<script") == 0);
  CHECK(unbalanced("<a><b></a>") > 0);
}

TEST_CASE("a report is written where it is wanted, in a folder that is made") {
  const test::TemporaryFolder folder;
  report::write_report(some_report(), folder.path() / "new" / "report.html");
  CHECK(std::filesystem::file_size(folder.path() / "new" / "report.html") > 1000);
  folder.file("plain", "text");
  CHECK_THROWS_AS(report::write_report(some_report(), folder.path() / "plain" / "report.html"),
                  OutputError);
}
