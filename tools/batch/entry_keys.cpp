#include "batch/entry_keys.hpp"

#include <string>
#include <utility>

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
  // From this entry back to the nearest one whose key is known.
  std::vector<std::size_t> path{index};
  std::optional<FitKey> earlier;
  while (before_[path.back()]) {
    const std::size_t before = *before_[path.back()];
    if ((earlier = known(before))) break;
    path.push_back(before);
  }
  for (auto i = path.rbegin(); i != path.rend(); ++i) {
    // Reads a mesh: other threads may read theirs meanwhile.
    FitKey key = options_.key(manifest_.entries[*i]);
    if (earlier) {
      base::FnvHash hash;
      hash.add(earlier->inputs + " " + earlier->options + " " + key.inputs);
      const bool is_missing = key.inputs.empty() || earlier->inputs.empty();
      key.inputs = is_missing ? std::string() : hash.text();
    }
    const std::lock_guard lock(mutex_);
    known_[*i] = key;
    earlier = std::move(key);
  }
  return *earlier;
}

std::optional<FitKey> EntryKeys::known(std::size_t index) const {
  const std::lock_guard lock(mutex_);
  const auto found = known_.find(index);
  return found == known_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace qjulia::batch
