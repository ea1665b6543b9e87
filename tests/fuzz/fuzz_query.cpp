// What pages ask of the server: what is read is a view, and the same from the same text; or what is
// to be made.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "explore/request.hpp"
#include "qjulia/base/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view text(reinterpret_cast<const char*>(data), size);
  qjulia::explore::Query query;
  while (!text.empty()) {
    const std::string_view part = text.substr(0, text.find('&'));
    const auto equal = std::min(part.find('='), part.size());
    query.emplace(part.substr(0, equal), part.substr(std::min(equal + 1, part.size())));
    text.remove_prefix(std::min(part.size() + 1, text.size()));
  }
  try {
    const auto view = qjulia::explore::read_view(query);
    if (qjulia::explore::read_view(query).studio_text != view.studio_text) std::abort();
    if (view.picture.width > 16384 || view.picture.samples > 4) std::abort();
  } catch (const qjulia::InputError&) {
  }
  try {
    const auto wanted = qjulia::explore::read_make(query);
    if (wanted.resolution > qjulia::explore::MakeRequest::kMostCells) std::abort();
    if (!wanted.is_turntable && wanted.extension.find('/') != std::string::npos) std::abort();
  } catch (const qjulia::InputError&) {
  }
  return 0;
}
