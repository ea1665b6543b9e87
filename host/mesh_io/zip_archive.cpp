#include "mesh_io/zip_archive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/deflate.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"

namespace qjulia::shape {
namespace {

constexpr std::string_view kCut =
    "it is not a complete ZIP archive; it may be cut off, export it again";

/// A little-endian number of an archive, whose place was checked before.
template <class Number>
Number number_at(std::string_view bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

/// `length` bytes from `at` on. @throws InputError where the archive has not so many.
std::string_view part_of(const MeshFile& file, std::uint64_t at, std::uint64_t length) {
  const std::string_view bytes = file.bytes();
  if (at > bytes.size() || length > bytes.size() - at) file.refuse(kCut);
  return bytes.substr(at, length);
}

/// The archive's list of entries.
struct Directory {
  std::uint64_t first = 0;  ///< where it begins
  std::uint64_t entries = 0;
};

Directory find_directory(const MeshFile& file) {
  constexpr std::size_t kEnd = 22, kLongestComment = 0xffff, kLocator = 20, kWideEnd = 56;
  using namespace std::string_view_literals;
  const std::string_view bytes = file.bytes();
  const std::size_t tail = bytes.size() - std::min(bytes.size(), kEnd + kLongestComment);
  const std::size_t end = bytes.rfind("PK\5\6"sv);
  if (end == std::string_view::npos || end < tail || bytes.size() - end < kEnd) file.refuse(kCut);
  const std::string_view about = bytes.substr(end, kEnd);
  Directory found{number_at<std::uint32_t>(about, 16), number_at<std::uint16_t>(about, 10)};
  if (found.first != 0xffffffff && found.entries != 0xffff) return found;
  if (end < kLocator || !bytes.substr(end - kLocator).starts_with("PK\6\7"sv)) return found;
  const auto wide_end = number_at<std::uint64_t>(bytes, end - kLocator + 8);
  const std::string_view wide = part_of(file, wide_end, kWideEnd);
  if (!wide.starts_with("PK\6\6"sv)) file.refuse(kCut);
  return {number_at<std::uint64_t>(wide, 48), number_at<std::uint64_t>(wide, 32)};
}

/// Replaces numbers that do not fit into 32 bits by those of the ZIP64 extra field.
void read_wide_numbers(std::string_view extra, ZipArchive::Entry& entry) {
  constexpr std::uint64_t kElsewhere = 0xffffffff;
  while (extra.size() >= 4) {
    const auto tag = number_at<std::uint16_t>(extra, 0);
    const std::size_t length = number_at<std::uint16_t>(extra, 2);
    extra.remove_prefix(4);
    std::string_view field = extra.substr(0, length);
    extra.remove_prefix(std::min(length, extra.size()));
    if (tag != 1) continue;
    for (std::uint64_t* number : {&entry.size, &entry.packed, &entry.header}) {
      if (*number != kElsewhere || field.size() < sizeof *number) continue;
      *number = number_at<std::uint64_t>(field, 0);
      field.remove_prefix(sizeof *number);
    }
  }
}

}  // namespace

ZipArchive::ZipArchive(const MeshFile& file) : file_(file) {
  const auto [first, count] = find_directory(file);
  add_entries(first, count);
}

void ZipArchive::add_entries(std::uint64_t first, std::uint64_t count) {
  constexpr std::size_t kDirectoryHeader = 46;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string_view header = part_of(file_, first, kDirectoryHeader);
    if (!header.starts_with("PK\1\2")) file_.refuse(kCut);
    Entry entry;
    entry.is_encrypted = (number_at<std::uint16_t>(header, 8) & 1U) != 0;
    entry.method = number_at<std::uint16_t>(header, 10);
    entry.crc = number_at<std::uint32_t>(header, 16);
    entry.packed = number_at<std::uint32_t>(header, 20);
    entry.size = number_at<std::uint32_t>(header, 24);
    entry.header = number_at<std::uint32_t>(header, 42);
    const std::size_t name = number_at<std::uint16_t>(header, 28);
    const std::size_t extra = number_at<std::uint16_t>(header, 30);
    const std::size_t comment = number_at<std::uint16_t>(header, 32);
    entry.name = part_of(file_, first + kDirectoryHeader, name);
    read_wide_numbers(part_of(file_, first + kDirectoryHeader + name, extra), entry);
    places_.try_emplace(base::lower_case(std::string(entry.name)), entries_.size());
    entries_.push_back(entry);
    first += kDirectoryHeader + name + extra + comment;
  }
}

const ZipArchive::Entry* ZipArchive::find(std::string_view name) const {
  const auto found = places_.find(base::lower_case(std::string(name)));
  return found == places_.end() ? nullptr : &entries_[found->second];
}

std::string_view ZipArchive::packed_bytes(const Entry& entry) const {
  constexpr std::size_t kLocalHeader = 30;
  const std::string_view header = part_of(file_, entry.header, kLocalHeader);
  if (!header.starts_with("PK\3\4")) file_.refuse(kCut);
  const std::uint64_t names =
      std::uint64_t{number_at<std::uint16_t>(header, 26)} + number_at<std::uint16_t>(header, 28);
  return part_of(file_, entry.header + kLocalHeader + names, entry.packed);
}

void ZipArchive::unpack(const Entry& entry,
                        const std::function<void(std::string_view part)>& take) {
  constexpr std::uint64_t kMostGrowth = 100, kSmall = std::uint64_t{16} << 20;
  constexpr unsigned kStored = 0, kDeflated = 8;
  const std::string name = base::to_utf8(entry.name);
  if (entry.is_encrypted) {
    file_.refuse(fmt::format("'{}' in it is encrypted; export it without a password", name));
  }
  if (entry.method != kStored && entry.method != kDeflated) {
    file_.refuse(
        fmt::format("'{}' in it is packed by method {}, neither stored nor deflated; "
                    "pack it again",
                    name, entry.method));
  }
  const std::uint64_t most = std::max(kSmall, kMostGrowth * file_.bytes().size());
  std::uint64_t size = 0;
  std::uint32_t crc = 0;
  const auto take_part = [&](std::string_view part) {
    file_.poll();
    size += part.size();
    unpacked_ += part.size();
    if (unpacked_ > most) {
      file_.refuse(
          fmt::format("it unpacks to more than {}, which is too much for a mesh; is it meant to "
                      "exhaust memory?",
                      base::size_text(most)));
    }
    if (size > entry.size) return false;
    crc = base::crc_32(part, crc);
    take(part);
    return true;
  };
  const std::string_view packed = packed_bytes(entry);
  const bool is_whole =
      entry.method == kStored ? take_part(packed) : base::inflate_bare(packed, take_part);
  if (!is_whole || size != entry.size || crc != entry.crc) {
    file_.refuse(fmt::format("'{}' in it is damaged; get or export it again", name));
  }
}

}  // namespace qjulia::shape
