#pragma once
/// The page that shows a batch.

#include <string>
#include <vector>

#include "batch/batch.hpp"
#include "batch/summary_table.hpp"

namespace qjulia::batch {

/// index.html: a table that a click on a heading sorts, with each entry's picture, the settings in
/// which entries differ, and the results; below it the common settings, warnings and errors. The
/// page links to pictures and maps and does not contain them, so it belongs in the batch's folder.
/// @param table of these entries.
std::string overview(const std::vector<EntryStatus>& entries, const SummaryTable& table);

}  // namespace qjulia::batch
