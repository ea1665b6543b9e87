#pragma once
/// ZIP archives, written entry by entry in bounded memory.

#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

namespace qjulia::base {

/// An archive of deflated entries (PKWARE's APPNOTE 6.3.9), ZIP64 where sizes or places need it.
/// Entries have the date 1980-01-01, so that the same contents give the same bytes.
class ZipFile {
 public:
  /// @param out is empty and seekable: sizes are filled in after each entry.
  explicit ZipFile(std::ostream& out);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  /// Ends the previous entry and begins a new one. Its contents are what is written to the stream
  /// until the next entry or `finish`.
  /// @param name ASCII, with slashes. @param most_bytes the entry is not longer; from about 4 GiB
  ///   on, it is of ZIP64's kind.
  std::ostream& begin(const std::string& name, std::uint64_t most_bytes);
  /// Ends the last entry and writes the directory. Check the state of `out` for errors.
  void finish();

 private:
  class Deflater;
  struct Entry {
    std::string name;
    bool is_large = false;  ///< its local header has ZIP64's sizes
    std::uint32_t checksum = 0;
    std::uint64_t bytes = 0, packed = 0, place = 0;
  };

  void end();
  std::string local_header(const Entry& entry) const;
  std::string directory_entry(const Entry& entry) const;
  void put(const std::string& bytes);

  std::ostream& out_;
  std::uint64_t written_ = 0;
  std::vector<Entry> entries_;
  std::unique_ptr<Deflater> deflater_;  ///< of the entry that is being written
  std::ostream contents_{nullptr};
};

}  // namespace qjulia::base
