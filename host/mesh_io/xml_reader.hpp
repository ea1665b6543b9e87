#pragma once
/// XML, an element at a time.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "mesh_io/mesh_file.hpp"

namespace qjulia::shape {

/// The attributes of an element.
class XmlAttributes {
 public:
  explicit XmlAttributes(const char* const* pairs) : pairs_(pairs) {}
  /// The value of the attribute of that name, of any namespace.
  std::optional<std::string_view> find(std::string_view name) const;

 private:
  const char* const* pairs_;
};

class XmlReader {
 public:
  /// `name` of an element is "NAMESPACE|NAME", or "NAME".
  using Start = std::function<void(std::string_view name, const XmlAttributes& attributes)>;
  using End = std::function<void(std::string_view name)>;

  /// What the functions throw ends reading, and `add` or `finish` throws it.
  /// @param part the document's name, for messages.
  XmlReader(const MeshFile& file, std::string part, Start start, End end);

  /// More of the document. @throws InputError where it is no XML, or declares a document type:
  /// entities could make it grow without limits.
  void add(std::string_view bytes);
  /// @throws InputError where the document has not ended.
  void finish();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace qjulia::shape
