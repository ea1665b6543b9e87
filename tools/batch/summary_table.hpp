#pragma once
/// A batch as a tidy table: an observation a row, a variable a column.

#include <string>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

struct SummaryRow {
  std::size_t entry = 0;           ///< index of its entry
  std::vector<std::string> cells;  ///< one a column; empty where there is nothing to say
};

struct SummaryTable {
  std::vector<std::string> columns;
  std::vector<SummaryRow> rows;
};

/// A row for every entry and every n that it is compared at; one, without n, for an entry that is
/// not compared. Columns, the same for all rows: name, n, mesh, map, state; every setting that any
/// entry has, by name; the figures of the comparison; those of the fit, "fit_" before them; seconds
/// (of the run that ended it), seconds_all (with earlier runs), warnings (how many), device, host,
/// started, error.
SummaryTable summary_table(const std::vector<EntryStatus>& entries);

}  // namespace qjulia::batch
