#include "mesh_io/xml_reader.hpp"

#include <expat.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <new>
#include <utility>

#include "base/text.hpp"

namespace qjulia::shape {

std::optional<std::string_view> XmlAttributes::find(std::string_view name) const {
  for (const char* const* pair = pairs_; *pair != nullptr; pair += 2) {
    std::string_view key = *pair;
    key.remove_prefix(key.rfind('|') + 1);  // npos + 1 is 0
    if (key == name) return pair[1];
  }
  return std::nullopt;
}

struct XmlReader::State {
  const MeshFile& file;
  std::string part;
  Start start;
  End end;
  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser;
  std::exception_ptr thrown;  ///< by a function that Expat, in C, called

  template <class Call>
  void guard(const Call& call) {
    if (thrown) return;
    try {
      call();
    } catch (...) {
      thrown = std::current_exception();
      XML_StopParser(parser.get(), XML_FALSE);
    }
  }
  static State& of(void* data) { return *static_cast<State*>(data); }

  static void XMLCALL on_start(void* data, const char* name, const char** attributes) {
    State& state = of(data);
    state.guard([&] { state.start(name, XmlAttributes(attributes)); });
  }
  static void XMLCALL on_end(void* data, const char* name) {
    State& state = of(data);
    state.guard([&] { state.end(name); });
  }
  static void XMLCALL on_doctype(void* data, const char* /*name*/, const char* /*system*/,
                                 const char* /*public*/, int /*has_subset*/) {
    State& state = of(data);
    state.guard([&] {
      state.file.refuse(
          fmt::format("'{}' in it declares a document type, which 3MF forbids", state.part));
    });
  }

  void parse(std::string_view bytes, bool is_last) {
    const XML_Status status =
        XML_Parse(parser.get(), bytes.data(), static_cast<int>(bytes.size()), is_last ? 1 : 0);
    if (thrown) std::rethrow_exception(thrown);
    if (status == XML_STATUS_OK) return;
    const XML_Error error = XML_GetErrorCode(parser.get());
    if (error == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
    file.refuse(fmt::format("'{}' in it is not well-formed XML: line {}: {}; export it again", part,
                            line(), XML_ErrorString(error)));
  }

  /// Where the parser is.
  std::uint64_t line() const {
#ifdef XML_ATTR_DEPRECATED  // Expat deprecates lines counted in 32 bits since it counts them in 64
    return XML_GetCurrentLineNumber64(parser.get());
#else
    return XML_GetCurrentLineNumber(parser.get());
#endif
  }
};

XmlReader::XmlReader(const MeshFile& file, std::string part, Start start, End end)
    : state_(std::make_shared<State>(State{file,
                                           base::to_utf8(part),
                                           std::move(start),
                                           std::move(end),
                                           {XML_ParserCreateNS(nullptr, '|'), XML_ParserFree},
                                           {}})) {
  XML_Parser parser = state_->parser.get();
  if (parser == nullptr) throw std::bad_alloc();
  XML_SetUserData(parser, state_.get());
  XML_SetElementHandler(parser, State::on_start, State::on_end);
  XML_SetStartDoctypeDeclHandler(parser, State::on_doctype);
}

void XmlReader::add(std::string_view bytes) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 20;  // Expat counts in an int
  for (; !bytes.empty(); bytes.remove_prefix(std::min(kAtOnce, bytes.size()))) {
    state_->parse(bytes.substr(0, kAtOnce), false);
  }
}

void XmlReader::finish() { state_->parse({}, true); }

}  // namespace qjulia::shape
