#pragma once
/// ZIP archives in memory (APPNOTE.TXT of PKWARE), as far as office and 3MF files use them: stored
/// and deflated entries, 64-bit sizes, no encryption, one volume.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "mesh_io/mesh_file.hpp"

namespace qjulia::shape {

class ZipArchive {
 public:
  struct Entry {
    std::string_view name;
    std::uint64_t header = 0;  ///< where its local header begins
    std::uint64_t packed = 0;  ///< bytes in the archive
    std::uint64_t size = 0;    ///< bytes unpacked, as is promised
    std::uint32_t crc = 0;
    unsigned method = 0;
    bool is_encrypted = false;
  };

  /// @param file must outlive the archive. @throws InputError where it is no whole archive.
  explicit ZipArchive(const MeshFile& file);

  /// The entry of that name, in any case of its letters, the first of several; null where there is
  /// none. Takes logarithmic time.
  const Entry* find(std::string_view name) const;

  /// Hands an entry's bytes to `take`, a part at a time. All that is unpacked together may be 100
  /// times as large as the archive, or 16 MiB.
  /// @throws InputError beyond that, and where the entry is damaged, encrypted or packed in another
  ///   way.
  void unpack(const Entry& entry, const std::function<void(std::string_view part)>& take);

 private:
  std::string_view packed_bytes(const Entry& entry) const;
  void add_entries(std::uint64_t first, std::uint64_t count);

  const MeshFile& file_;
  std::vector<Entry> entries_;
  std::map<std::string, std::size_t, std::less<>> places_;  ///< in entries_, by lower-case names
  std::uint64_t unpacked_ = 0;                              ///< bytes so far
};

}  // namespace qjulia::shape
