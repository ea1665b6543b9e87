#include "base/zip_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>
#include <streambuf>

namespace qjulia::base {
namespace {

constexpr std::uint32_t kZipMark = std::numeric_limits<std::uint32_t>::max();
/// Deflate's own overhead on bytes that cannot be made smaller is far below this share.
constexpr std::uint64_t kMostUnmarked = std::uint64_t{kZipMark} - (std::uint64_t{1} << 24);

/// The lowest `count` bytes, the lowest first.
std::string little_endian(std::uint64_t value, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<char>(value >> (8 * i) & 0xff));
  return bytes;
}
std::string two(std::uint64_t value) { return little_endian(value, 2); }
std::string four(std::uint64_t value) { return little_endian(value, 4); }
std::string eight(std::uint64_t value) { return little_endian(value, 8); }

/// The value where it fits, else the mark that ZIP64's field has it.
std::string four_or_mark(std::uint64_t value) {
  return four(std::min<std::uint64_t>(value, kZipMark));
}

constexpr std::uint64_t kPlainVersion = 20, kZip64Version = 45;  // needed to extract
constexpr std::uint64_t kUnixMade = 3 << 8;                      // "made by"
constexpr std::uint64_t kZip64Field = 1;

/// What local headers and the directory say alike: flags, method, time and date, checksum.
std::string common_fields(std::uint32_t checksum) {
  constexpr std::uint64_t kDeflated = 8, kFirstOfJanuary1980 = 0x21;
  return two(0) + two(kDeflated) + two(0) + two(kFirstOfJanuary1980) + four(checksum);
}

}  // namespace

/// Raw deflate into the archive's stream.
class ZipFile::Deflater final : public std::streambuf {
 public:
  explicit Deflater(ZipFile& zip) : zip_(zip) {
    constexpr int kLevel = 4, kRaw = -15, kMemory = 8;  // raw: no header of zlib's
    if (deflateInit2(&stream_, kLevel, Z_DEFLATED, kRaw, kMemory, Z_DEFAULT_STRATEGY) != Z_OK) {
      throw std::runtime_error("zlib has no memory");
    }
  }
  ~Deflater() override { deflateEnd(&stream_); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void end() { deflate_all(nullptr, 0, Z_FINISH); }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t packed() const { return packed_; }
  std::uint32_t checksum() const { return checksum_; }

 protected:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char byte = traits_type::to_char_type(c);
    return xsputn(&byte, 1) == 1 ? c : traits_type::eof();
  }

  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    constexpr std::streamsize kAtOnce = std::streamsize{1} << 30;  // zlib counts in 32 bits
    for (std::streamsize done = 0; done < count;) {
      const std::streamsize some = std::min(count - done, kAtOnce);
      deflate_all(bytes + done, static_cast<uInt>(some), Z_NO_FLUSH);
      done += some;
    }
    return zip_.out_ ? count : 0;
  }

 private:
  void deflate_all(const char* bytes, uInt count, int flush) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes));  // NOLINT: only read
    stream_.avail_in = count;
    if (count > 0) {
      checksum_ = static_cast<std::uint32_t>(crc32(checksum_, stream_.next_in, count));
    }
    bytes_ += count;
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());  // NOLINT: as zlib takes them
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, flush);
      const std::size_t made = buffer_.size() - stream_.avail_out;
      zip_.out_.write(buffer_.data(), static_cast<std::streamsize>(made));
      packed_ += made;
    } while (stream_.avail_out == 0);
  }

  ZipFile& zip_;
  z_stream stream_{};
  std::string buffer_ = std::string(std::size_t{1} << 16, '\0');
  std::uint64_t bytes_ = 0, packed_ = 0;
  std::uint32_t checksum_ = 0;
};

ZipFile::ZipFile(std::ostream& out) : out_(out) {}
ZipFile::~ZipFile() = default;

void ZipFile::put(const std::string& bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  written_ += bytes.size();
}

std::string ZipFile::local_header(const Entry& entry) const {
  const std::string sizes =
      entry.is_large ? four(kZipMark) + four(kZipMark) : four(entry.packed) + four(entry.bytes);
  const std::string extra =
      entry.is_large ? two(kZip64Field) + two(16) + eight(entry.bytes) + eight(entry.packed)
                     : std::string();
  return "PK\x03\x04" + two(entry.is_large ? kZip64Version : kPlainVersion) +
         common_fields(entry.checksum) + sizes + two(entry.name.size()) + two(extra.size()) +
         entry.name + extra;
}

std::string ZipFile::directory_entry(const Entry& entry) const {
  std::string large;  // the fields that do not fit, in this order
  for (const std::uint64_t value : {entry.bytes, entry.packed, entry.place}) {
    if (value >= kZipMark) large += eight(value);
  }
  const std::string extra = large.empty() ? large : two(kZip64Field) + two(large.size()) + large;
  const bool is_large = entry.is_large || !large.empty();
  const std::uint64_t version = is_large ? kZip64Version : kPlainVersion;
  constexpr std::uint64_t kReadable = std::uint64_t{0100644} << 16;
  return "PK\x01\x02" + two(kUnixMade | version) + two(version) + common_fields(entry.checksum) +
         four_or_mark(entry.packed) + four_or_mark(entry.bytes) + two(entry.name.size()) +
         two(extra.size()) + two(0) + two(0) + two(0) + four(kReadable) +
         four_or_mark(entry.place) + entry.name + extra;
}

std::ostream& ZipFile::begin(const std::string& name, std::uint64_t most_bytes) {
  end();
  Entry& entry = entries_.emplace_back();
  entry.name = name;
  entry.is_large = most_bytes >= kMostUnmarked;
  entry.place = written_;
  put(local_header(entry));
  deflater_ = std::make_unique<Deflater>(*this);
  contents_.rdbuf(deflater_.get());  // and clears the stream's state
  return contents_;
}

void ZipFile::end() {
  if (!deflater_) return;
  deflater_->end();
  Entry& entry = entries_.back();
  entry.bytes = deflater_->bytes();
  entry.packed = deflater_->packed();
  entry.checksum = deflater_->checksum();
  contents_.rdbuf(nullptr);
  deflater_.reset();
  if (!entry.is_large && std::max(entry.bytes, entry.packed) >= kZipMark) {
    throw std::logic_error("an entry of a ZIP archive is longer than was announced");
  }
  written_ += entry.packed;
  out_.seekp(static_cast<std::streamoff>(entry.place));
  const std::string header = local_header(entry);
  out_.write(header.data(), static_cast<std::streamsize>(header.size()));
  out_.seekp(static_cast<std::streamoff>(written_));
}

void ZipFile::finish() {
  end();
  const std::uint64_t place = written_;
  for (const Entry& entry : entries_) put(directory_entry(entry));
  const std::uint64_t size = written_ - place, count = entries_.size();
  if (place >= kZipMark) {
    const std::uint64_t end = written_;
    constexpr std::uint64_t kRest = 44;  // bytes of the record behind its size
    put("PK\x06\x06" + eight(kRest) + two(kUnixMade | kZip64Version) + two(kZip64Version) +
        four(0) + four(0) + eight(count) + eight(count) + eight(size) + eight(place));
    put("PK\x06\x07" + four(0) + eight(end) + four(1));
  }
  put("PK\x05\x06" + two(0) + two(0) + two(count) + two(count) + four(size) + four_or_mark(place) +
      two(0));
}

}  // namespace qjulia::base
