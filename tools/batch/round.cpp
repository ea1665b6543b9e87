#include "batch/round.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

using nlohmann::json;

Error not_understood() {
  return Error(
      "the ranks of this batch do not understand each other; start all of them with the same "
      "version of the program");
}

EntryState state_of(int number) {
  const auto state = static_cast<EntryState>(number);
  if (std::ranges::find(kEntryStates, state) == kEntryStates.end()) throw not_understood();
  return state;
}

}  // namespace

std::string packed(const RoundMessage& message) {
  json put_back = json::array(), requests = json::array();
  for (const auto& [entry, state] : message.put_back) {
    put_back.push_back({{"entry", entry}, {"state", static_cast<int>(state)}});
  }
  for (const auto& [runner, last_choice] : message.requests) {
    requests.push_back({{"runner", runner}, {"last_choice", last_choice}});
  }
  const auto bytes = json::to_cbor({{"runners", message.runners},
                                    {"ready", message.is_ready},
                                    {"put_back", std::move(put_back)},
                                    {"requests", std::move(requests)}});
  return {bytes.begin(), bytes.end()};
}

RoundMessage unpacked(const std::string& bytes) {
  RoundMessage message;
  try {
    const json j = json::from_cbor(bytes);
    message.runners = j.at("runners");
    message.is_ready = j.at("ready");
    for (const json& p : j.at("put_back")) {
      message.put_back.push_back({p.at("entry"), state_of(p.at("state"))});
    }
    for (const json& r : j.at("requests")) {
      message.requests.push_back(
          {r.at("runner"), r.at("last_choice").get<std::set<std::size_t>>()});
    }
  } catch (const json::exception&) {
    throw not_understood();
  }
  return message;
}

}  // namespace qjulia::batch
