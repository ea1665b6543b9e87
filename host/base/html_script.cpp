#include "base/html_script.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "base/text.hpp"

namespace qjulia::base {
namespace {

constexpr std::string_view kWhitespace = " \t\r\n\f";
/// Characters that end the name of an element. All but the slash also end an unquoted value.
constexpr std::string_view kNameEnds = " \t\r\n\f/>";

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// Elements that hold text and no other elements.
bool holds_text_alone(std::string_view element) {
  constexpr std::array<std::string_view, 8> kElements{"script", "style",  "title",   "textarea",
                                                      "xmp",    "iframe", "noembed", "noframes"};
  return std::ranges::find(kElements, element) != kElements.end();
}

struct Tag {
  std::string name;  ///< in lower case
  std::optional<std::string_view> id;
};

/// Takes tags, comments and texts off the front of a page, as the HTML standard's tokenizer does
/// (https://html.spec.whatwg.org/multipage/parsing.html#tokenization).
class Scanner {
 public:
  explicit Scanner(std::string_view page) : rest_(page) {}

  /// The next start tag; nothing at the page's end. Comments, end tags and text before the tag are
  /// passed over.
  std::optional<Tag> next_start() {
    for (;;) {
      skip(std::min(rest_.find('<'), rest_.size()));
      if (rest_.empty()) return std::nullopt;
      if (rest_.starts_with("<!--")) {
        skip_comment();
      } else if (rest_.size() > 1 && is_letter(rest_[1])) {
        skip(1);
        return take_tag();
      } else if (rest_.size() > 2 && rest_[1] == '/' && is_letter(rest_[2])) {
        skip(2);
        take_tag();
      } else if (rest_.size() > 1 && (rest_[1] == '!' || rest_[1] == '?' || rest_[1] == '/')) {
        skip_past(">", 2);
      } else {
        skip(1);  // text
      }
    }
  }

  /// The text up to the end tag of an element that holds only text, or up to the page's end.
  std::string_view take_text(std::string_view element) {
    for (auto end = rest_.find("</"); end != std::string_view::npos;
         end = rest_.find("</", end + 2)) {
      const std::string_view tag = rest_.substr(end + 2);
      if (lower_case(std::string(tag.substr(0, element.size()))) != element) continue;
      const std::string_view after = tag.substr(element.size());
      if (!after.empty() && after.find_first_of(kNameEnds) != 0) continue;
      return take(end);
    }
    return take(rest_.size());
  }

 private:
  void skip(std::size_t count) { rest_.remove_prefix(count); }
  std::string_view take(std::size_t count) {
    const std::string_view front = rest_.substr(0, count);
    skip(front.size());
    return front;
  }
  std::string_view take_until(std::string_view ends) {
    return take(std::min(rest_.find_first_of(ends), rest_.size()));
  }
  void skip_blanks() { skip(std::min(rest_.find_first_not_of(kWhitespace), rest_.size())); }
  void skip_past(std::string_view end, std::size_t from) {
    const auto at = rest_.find(end, from);
    skip(at == std::string_view::npos ? rest_.size() : at + end.size());
  }

  /// "<!-->" and "<!--->" are complete comments.
  void skip_comment() {
    const auto usual = rest_.find("-->", 2), odd = rest_.find("--!>", 4);
    skip_past(">", std::min({usual, odd, rest_.size()}));
  }

  /// Reads from a tag's name through its '>'; nothing if the page ends before that.
  std::optional<Tag> take_tag() {
    Tag tag{lower_case(std::string(take_until(kNameEnds))), std::nullopt};
    for (;;) {
      skip(std::min(rest_.find_first_not_of(" \t\r\n\f/"), rest_.size()));
      if (rest_.empty()) return std::nullopt;
      if (rest_.front() == '>') {
        skip(1);
        return tag;
      }
      take_attribute(tag);
    }
  }

  void take_attribute(Tag& tag) {
    // A name may begin with '='.
    const std::size_t end = std::min(rest_.find_first_of(" \t\r\n\f/>=", 1), rest_.size());
    const std::string name = lower_case(std::string(take(end)));
    skip_blanks();
    std::string_view value;
    if (rest_.starts_with('=')) {
      skip(1);
      skip_blanks();
      value = take_value();
    }
    if (name == "id" && !tag.id) tag.id = value;
  }

  std::string_view take_value() {
    if (!rest_.starts_with('"') && !rest_.starts_with('\'')) return take_until(" \t\r\n\f>");
    const std::string_view quote = take(1);
    const std::string_view value = take_until(quote);
    skip(std::min<std::size_t>(1, rest_.size()));
    return value;
  }

  std::string_view rest_;
};

}  // namespace

std::optional<std::string_view> script_in(std::string_view page, std::string_view id) {
  Scanner scanner(page);
  while (const auto tag = scanner.next_start()) {
    if (!holds_text_alone(tag->name)) continue;
    const std::string_view text = scanner.take_text(tag->name);
    if (tag->name == "script" && tag->id == id) return text;
  }
  return std::nullopt;
}

}  // namespace qjulia::base
