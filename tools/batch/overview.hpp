#pragma once
/// The page that shows a batch.

#include <string>
#include <vector>

#include "batch/batch.hpp"
#include "batch/summary_table.hpp"

namespace qjulia::batch {

/// index.html: a picture of each entry that has one, beside what sets it apart and what came of it,
/// in a table that is sorted by a click on a heading; below, what is the same for all, warnings and
/// errors. Pictures and maps are named, not held: the page belongs in the batch's folder.
/// @param table of these entries.
std::string overview(const std::vector<EntryStatus>& entries, const SummaryTable& table);

}  // namespace qjulia::batch
