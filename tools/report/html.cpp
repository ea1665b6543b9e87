#include "report/html.hpp"

#include <fmt/format.h>

#include "base/base64.hpp"
#include "base/markup.hpp"

namespace qjulia::html {
namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;"
    "color:#222;background:#fff}"
    "h1{font-size:1.6rem}h2{font-size:1.15rem;margin-top:2rem}"
    "table{border-collapse:collapse}th,td{padding:.2rem .9rem .2rem 0;text-align:left;"
    "border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}"
    ".row{display:flex;flex-wrap:wrap;gap:1rem}figure{margin:0;flex:1 1 18rem}"
    "figure img{width:100%;height:auto}figcaption{color:#555}"
    "pre{background:#f6f6f6;padding:.8rem;overflow-x:auto;font-size:.8rem}";

std::string cells(const std::vector<std::string>& texts, const char* element) {
  std::string row = "<tr>";
  for (const std::string& text : texts) {
    row += fmt::format("<{0}>{1}</{0}>", element, escaped(text));
  }
  return row + "</tr>\n";
}

}  // namespace

std::string escaped(std::string_view text) { return base::markup(text); }

std::string table(const std::vector<std::string>& headings,
                  const std::vector<std::vector<std::string>>& rows) {
  std::string text = "<table>\n" + cells(headings, "th");
  for (const auto& row : rows) text += cells(row, "td");
  return text + "</table>\n";
}

std::string figure(const Image& image, const std::string& caption) {
  const std::string label = escaped(caption);
  return fmt::format(
      "<figure><img alt=\"{0}\" width=\"{1}\" height=\"{2}\" src=\"data:image/png;base64,{3}\"/>"
      "<figcaption>{0}</figcaption></figure>\n",
      label, image.width, image.height, base::base64(png_bytes(image)));
}

std::string page(const std::string& title, const std::string& body, const std::string& head) {
  return fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\"><head>"
      "<meta charset=\"utf-8\"/><title>{0}</title><style>{1}</style>{3}</head>\n"
      "<body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      escaped(title), kStyle, body, head);
}

}  // namespace qjulia::html
