#pragma once
/// Compiled programs on disk, so that a driver need not compile them in each process.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace qjulia::device {

/// What a compiled program depends on.
struct ProgramKey {
  std::string owner;    ///< device, platform and driver
  std::string options;  ///< the compiler's
  std::string source;   ///< whole
  /// 16 hexadecimal digits.
  std::string name() const;
};

struct StoredProgram {
  std::vector<std::string> kernels;  ///< names
  std::string binary;
};

/// A folder with one file a program. Several processes may use it at a time. What cannot be written
/// is not kept, and what is damaged is not found.
class ProgramStore {
 public:
  static constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;

  /// @param most_bytes of all files: those that were not used for longest are removed beyond that.
  explicit ProgramStore(std::filesystem::path folder, std::uint64_t most_bytes = kMostBytes);

  std::filesystem::path file(const ProgramKey& key) const;
  /// None where there is no file, or one that is damaged or of another program.
  std::optional<StoredProgram> load(const ProgramKey& key) const;
  void save(const ProgramKey& key, const StoredProgram& program) const;

 private:
  void remove_oldest(const std::filesystem::path& kept) const;

  std::filesystem::path folder_;
  std::uint64_t most_bytes_;
};

}  // namespace qjulia::device
