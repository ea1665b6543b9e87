#include "batch/entry_keys.hpp"

#include <string>

#include "base/fnv_hash.hpp"

namespace qjulia::batch {

EntryKeys::EntryKeys(const Manifest& manifest, const BatchOptions& options)
    : manifest_(manifest), options_(options) {
  std::map<std::string, std::size_t> places;
  for (const BatchEntry& entry : manifest.entries) {
    const auto found = places.find(entry.follows);
    before_.push_back(found == places.end() ? std::nullopt : std::optional(found->second));
    places.emplace(entry.name, before_.size() - 1);
  }
}

FitKey EntryKeys::of(std::size_t index) {
  const std::lock_guard lock(mutex_);
  // From the nearest entry whose key is known to this one.
  std::vector<std::size_t> path{index};
  while (before_[path.back()] && !known_.contains(*before_[path.back()])) {
    path.push_back(*before_[path.back()]);
  }
  FitKey key;
  for (auto i = path.rbegin(); i != path.rend(); ++i) {
    key = options_.key(manifest_.entries[*i]);
    if (const auto& before = before_[*i]) {
      const FitKey& earlier = known_.at(*before);
      base::FnvHash hash;
      hash.add(earlier.inputs + " " + earlier.options + " " + key.inputs);
      const bool is_missing = key.inputs.empty() || earlier.inputs.empty();
      key.inputs = is_missing ? std::string() : hash.text();
    }
    known_[*i] = key;
  }
  return key;
}

}  // namespace qjulia::batch
