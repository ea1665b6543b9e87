#pragma once
/// Many fits from one manifest.

#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "batch/folder_lock.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::batch {

class BatchRanks;
class EnergyMeter;

/// An option of a fit as a manifest gives it.
struct ManifestOption {
  std::string name;                 ///< as on the command line, without the leading dashes
  std::vector<std::string> values;  ///< one; none for a flag
  std::size_t line = 0;             ///< in the manifest
};

/// A command that makes one more file of a fit's map.
struct EntryJob {
  std::string command;                                ///< "render"
  std::string extension;                              ///< of the file, such as ".png"
  nlohmann::json options = nlohmann::json::object();  ///< as jobs have them, but for the map
};

/// What is written of a fit beside its map.
struct BatchOutputs {
  std::optional<EntryJob> surface, picture;
  bool report = false;           ///< NAME.report.html
  std::vector<int> compare;      ///< each n at which the map is compared with its mesh; empty: none
  int compare_resolution = 128;  ///< cells along each side of the comparison's cube
};

/// One mesh to fit.
struct BatchEntry {
  std::string name;  ///< its files begin with it; no other entry has it
  std::filesystem::path mesh;
  std::vector<ManifestOption> options;  ///< the entry's own, then defaults it does not override
  BatchOutputs outputs;
  std::size_t line = 0;   ///< where its [[fit]] or [[sweep]] begins
  std::size_t place = 0;  ///< in the whole manifest, where it is divided
  /// The name of an earlier entry, the frame before this one, from whose map its fit starts; empty:
  /// none.
  std::string follows{};
  /// Which frame of the point cache `mesh`, from 0 on; none: `mesh` is a mesh.
  std::optional<std::size_t> frame{};
};

/// A part of a batch.
struct Shard {
  std::size_t number = 1;  ///< from 1 to `count`
  std::size_t count = 1;
  bool operator==(const Shard&) const = default;
};

struct Manifest {
  std::filesystem::path file;
  std::optional<Shard> shard{};     ///< whose entries these are; none: all of them
  std::size_t all_entries = 0;      ///< of the whole manifest, where it is divided
  std::string list_hash{};          ///< of those, where it is divided
  std::vector<BatchEntry> entries;  ///< in the manifest's order; those of a glob by name
};

/// The keys of a [[fit]] besides the options of a fit: "mesh", "sequence", "name" and the outputs.
std::vector<std::string> manifest_keys();

/// What says whether a manifest can be run.
struct ManifestChecks {
  /// @throws InputError unless these options, together, make a fit.
  std::function<void(const std::vector<ManifestOption>&)> options;
  /// Checks a job, in which paths from `folder` become absolute. @throws InputError
  std::function<void(EntryJob&, const std::filesystem::path& folder)> job;
};

/// Reads a TOML manifest (docs/guide/batch.md). Paths in it are relative to the manifest's folder.
/// A
/// [[sweep]] gives an entry for each mesh and each combination of the values that it lists; the
/// names contain the values, so that an entry keeps its name when others are added or lines are
/// moved. A `sequence` gives an entry for each of its meshes, or for each frame of its point cache,
/// which follows the one before.
/// @param meshes_may_be_missing entries whose mesh does not exist are kept: for a batch that is
///   resumed after a mesh has vanished.
/// @param stop ends waiting for a pipe: Interrupted.
/// @throws InputError naming file, line and what to do, of everything that is wrong at once: not
///   TOML, unknown keys, values of the wrong kind, two entries of one name, meshes that are missing
///   or not regular files, lists with nothing in them or with a value twice, sweeps of more than
///   100,000 fits, sequences of one mesh.
Manifest read_manifest(const std::filesystem::path& file, const ManifestChecks& checks,
                       bool meshes_may_be_missing = false, std::stop_token stop = {});

/// What makes a fit the same fit: hashes of what it reads and of how it is done.
struct FitKey {
  std::string inputs;  ///< empty when the mesh cannot be read
  std::string options;
  bool operator==(const FitKey&) const = default;
};

enum class EntryState {
  waiting,  ///< not begun, or given back
  running,
  lost,         ///< its process has ended without a word
  interrupted,  ///< stopped on request
  failed,
  done,
};
/// What has ended first.
inline constexpr std::array kEntryStates{EntryState::done,    EntryState::failed,
                                         EntryState::running, EntryState::interrupted,
                                         EntryState::lost,    EntryState::waiting};
std::string to_string(EntryState state);

/// A try that a device, not the entry, was to blame for.
struct FailedTry {
  std::string device;
  std::string error;
};

/// Where one entry stands; NAME.status.json holds it.
struct EntryStatus {
  std::string name;
  std::string mesh;
  EntryState state = EntryState::waiting;
  FitKey key;
  std::string host;
  long process = 0;
  std::string device;
  std::string started;         ///< UTC, ISO 8601
  double seconds = 0;          ///< of the latest run
  double earlier_seconds = 0;  ///< of earlier runs for the same key that did not finish it
  /// Every option, by name, of the fit, "version" of the program and "compare"; empty when a
  /// version of the program wrote it that did not keep them.
  nlohmann::json settings = nlohmann::json::object();
  Progress progress;             ///< while running
  std::optional<double> energy;  ///< of the latest evaluation of the run
  /// The most memory that the process had at once since it last began an entry while no other ran,
  /// thus at least in this run; 0 where the system does not say.
  std::uint64_t memory_bytes = 0;
  /// The energy that the device took during this run, whatever else ran on it; none where the
  /// system does not say. Entries that run at the same time on one device share it equally.
  std::optional<double> joules;
  std::string error;
  std::vector<FailedTry> failed_tries;
  std::vector<std::string> files;  ///< in the batch's folder; until it is done, an earlier run's
  nlohmann::json figures = nlohmann::json::object();  ///< energy, IoU, evaluations …
  nlohmann::json to_json() const;
};

/// A finished fit.
struct EntryResult {
  std::vector<std::string> files;  ///< names in the batch's folder
  nlohmann::json figures;
};

/// What an entry tells while it runs.
struct EntryMonitor : ProgressMonitor {
  std::function<void(double)> on_energy;  ///< of each evaluation of the fit; may be empty
};

/// Runs entries one after another on one device. Writes an entry's files into `folder`, each under
/// its name only when it is complete.
/// @throws DeviceError, KernelBuildError: the device is to blame, another may do it; Interrupted;
///   whatever else: the entry has failed.
using BatchWorker = std::function<EntryResult(
    const BatchEntry& entry, const std::filesystem::path& folder, const EntryMonitor& monitor)>;

/// One of the queues a batch runs on: a device, or a share of one.
struct BatchDevice {
  std::string name;
  /// Opens it, again after it has failed. @throws Error
  std::function<BatchWorker()> open;
  std::shared_ptr<EnergyMeter> energy{};  ///< of the whole device; null: it does not say
};

struct BatchOptions {
  std::filesystem::path folder;
  bool resume = false;        ///< keep what is complete, by its key; else do all again
  bool retry_failed = false;  ///< when resuming
  std::function<FitKey(const BatchEntry&)> key;
  /// The options of an entry's fit by name, for the summary; may be empty.
  std::function<nlohmann::json(const BatchEntry&)> settings = {};
};

/// A moment of a batch.
struct BatchEvent {
  enum class Kind { started, progress, done, failed, given_back, interrupted, retired, rank_lost };
  Kind kind;
  bool earlier = false;                 ///< done or failed before this run
  bool elsewhere = false;               ///< told of by another rank, which did it or is rank 0
  const EntryStatus* status = nullptr;  ///< null when a device is retired or a rank lost
  std::string device{};                 ///< or the rank that is lost
  std::string message{};  ///< why an entry is given back or a device retired; of a lost rank, what
                          ///< becomes of its entries
};

/// Makes the folder and takes its lock, removes what an earlier run left half done, and unless
/// resuming forgets what it did not finish. Once a batch, by rank 0, before any rank runs it.
/// @return the lock, to be held until the batch has ended.
/// @throws InputError when a file of the batch would overwrite one of its inputs; Error when
/// another
///   process has the folder; OutputError when it cannot be written.
FolderLock prepare_batch(const Manifest& manifest, const BatchOptions& options);

/// Runs entries on the devices of all ranks, a thread each, until every entry is settled, all
/// devices are retired, or a stop is requested. A device that fails three entries in a row is
/// retired; an entry that fails on devices three times has failed.
/// @param observe called by one thread at a time.
/// @param ranks those that run the batch together; null: this process alone.
/// @return entries whose state could not be written down by this rank.
std::vector<EntryStatus> run_batch(const Manifest& manifest,
                                   const std::vector<BatchDevice>& devices,
                                   const BatchOptions& options,
                                   const std::function<void(const BatchEvent&)>& observe = {},
                                   std::stop_token stop = {}, BatchRanks* ranks = nullptr);

/// What becomes of entries whose status cannot be read: they wait, with the reason as their error,
/// or InputError is thrown.
enum class UnreadableStatus { shown, refused };

/// Every entry of the batch in `folder`, in the manifest's order, from any rank.
/// @param is_running whether a process has the folder: what is under way is lost without.
/// @throws InputError when there is no batch.
std::vector<EntryStatus> read_batch(const std::filesystem::path& folder, bool is_running,
                                    UnreadableStatus unreadable = UnreadableStatus::shown);

/// Writes summary.json, summary.csv, index.html, and contact_sheet.png of the pictures there are.
/// @throws OutputError
void write_summary(const std::filesystem::path& folder, const std::vector<EntryStatus>& entries);

}  // namespace qjulia::batch
