#include "batch/overview.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "base/text.hpp"
#include "report/html.hpp"

namespace qjulia::batch {
namespace {

constexpr const char* kHead =
    "<style>body{max-width:none}.wide{overflow-x:auto}td img{width:10rem;height:auto;display:block}"
    "thead th{position:sticky;top:0;background:#fff;vertical-align:bottom}"
    "th button{font:inherit;border:0;padding:0;background:none;cursor:pointer;text-align:left}"
    "th[aria-sort=ascending] button::after{content:' \\25B2'}"
    "th[aria-sort=descending] button::after{content:' \\25BC'}</style>";

/// Numbers by value where all are numbers, else as text; empty cells last either way. Without < and
/// &, so that the page is XML, too.
constexpr const char* kScript = R"(<script>
for (const button of document.querySelectorAll('th button')) {
  button.onclick = () => {
    const heading = button.parentElement;
    const body = heading.closest('table').tBodies[0];
    const descending = heading.getAttribute('aria-sort') === 'ascending';
    for (const other of heading.parentElement.cells) other.removeAttribute('aria-sort');
    heading.setAttribute('aria-sort', descending ? 'descending' : 'ascending');
    const text = row => row.cells[heading.cellIndex].textContent;
    const rows = Array.from(body.rows);
    const numeric = !rows.some(row => isNaN(Number(text(row))));
    rows.sort((a, b) => {
      const x = text(a), y = text(b);
      if (x === '' || y === '') return (x === '') - (y === '');
      const order = numeric ? x - y : x.localeCompare(y);
      return descending ? -order : order;
    });
    body.append(...rows);
  };
}
</script>
)";

/// A file's name as a relative address.
std::string address(const std::string& name) { return "./" + base::percent_encoded(name); }

std::string link(const std::string& file, const std::string& text) {
  return fmt::format("<a href=\"{}\">{}</a>", address(file), html::escaped(text));
}

std::string picture_cell(const EntryStatus& entry) {
  for (const std::string& file : entry.files) {
    if (entry.state != EntryState::done || !file.ends_with(".png")) continue;
    return fmt::format(
        "<td><a href=\"{0}\"><img loading=\"lazy\" alt=\"{1}\" src=\"{0}\"/></a></td>",
        address(file), html::escaped(entry.name));
  }
  return "<td></td>";
}

/// What the page shows of a cell: numbers with a fraction to four digits.
std::string short_text(const std::string& cell) {
  double number = 0;
  const char* const end = cell.data() + cell.size();
  const auto [read, error] = std::from_chars(cell.data(), end, number);
  const bool is_fraction = cell.find_first_of(".e") != std::string::npos;
  return error == std::errc() && read == end && is_fraction ? fmt::format("{:.4g}", number) : cell;
}

/// Whether all rows say the same in this column.
bool is_same(const SummaryTable& table, std::size_t column) {
  return std::ranges::all_of(table.rows, [&](const SummaryRow& row) {
    return row.cells[column] == table.rows.front().cells[column];
  });
}

/// Columns that tell rows apart; the name, the n and the state always, errors never: they stand
/// below.
std::vector<std::size_t> shown_columns(const SummaryTable& table) {
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::string& name = table.columns[i];
    const bool always = name == "name" || name == "n" || name == "state";
    const bool never = name == "error" || name == "map" || name == "mesh";
    if (always || (!never && !is_same(table, i))) shown.push_back(i);
  }
  return shown;
}

std::string body_row(const EntryStatus& entry, const SummaryTable& table, const SummaryRow& row,
                     const std::vector<std::size_t>& shown) {
  std::string text = fmt::format("<tr>{}", picture_cell(entry));
  for (const std::size_t column : shown) {
    const std::string& cell = row.cells[column];
    const bool is_name = table.columns[column] == "name";
    const std::string shown_cell = is_name && entry.state == EntryState::done
                                       ? link(fmt::format("{}.qjulia.json", entry.name), cell)
                                       : html::escaped(is_name ? cell : short_text(cell));
    text += fmt::format("<td>{}</td>", shown_cell);
  }
  text += "</tr>\n";
  return text;
}

std::string same_for_all(const SummaryTable& table) {
  if (table.rows.size() < 2) return {};
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    const std::string& cell = table.rows.front().cells[i];
    const std::string& name = table.columns[i];
    if (!cell.empty() && name != "state" && name != "n" && is_same(table, i))
      rows.push_back({name, cell});
  }
  if (rows.empty()) return {};
  return fmt::format("<h2>The same for all</h2>\n{}", html::table({"column", "value"}, rows));
}

std::string words_of(const std::vector<EntryStatus>& entries) {
  std::string items;
  for (const EntryStatus& entry : entries) {
    std::vector<std::string> words;
    if (!entry.error.empty()) words.push_back(entry.error);
    if (const auto found = entry.figures.find("warnings"); found != entry.figures.end()) {
      for (const nlohmann::json& one : *found) words.push_back(one.get<std::string>());
    }
    for (const std::string& word : words) {
      items += fmt::format("<li>{}: {}</li>\n", html::escaped(entry.name), html::escaped(word));
    }
  }
  if (items.empty()) return {};
  return fmt::format("<h2>Warnings and errors</h2>\n<ul>\n{}</ul>\n", items);
}

}  // namespace

std::string overview(const std::vector<EntryStatus>& entries, const SummaryTable& table) {
  const auto shown = shown_columns(table);
  std::string body = fmt::format(
      "<p>{} of {} done. {} and {} have every column.</p>\n<div class=\"wide\"><table>\n"
      "<thead><tr><th>picture</th>",
      std::ranges::count(entries, EntryState::done, &EntryStatus::state), entries.size(),
      link("summary.csv", "summary.csv"), link("summary.json", "summary.json"));
  for (const std::size_t column : shown) {
    body += fmt::format("<th><button type=\"button\">{}</button></th>",
                        html::escaped(table.columns[column]));
  }
  body += "</tr></thead>\n<tbody>\n";
  for (const SummaryRow& row : table.rows) body += body_row(entries[row.entry], table, row, shown);
  body += fmt::format("</tbody></table></div>\n{}{}{}", same_for_all(table), words_of(entries),
                      kScript);
  return html::page("Batch", body, kHead);
}

}  // namespace qjulia::batch
