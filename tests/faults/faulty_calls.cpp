/// A system with faults: loaded before all other libraries (LD_PRELOAD). Calls are counted that the
/// program makes from main on, itself or through a library that it is linked to, but not those of
/// OpenCL drivers, which may end the process when theirs fail.
/// The environment says which call fails, once, and what is told:
/// QJULIA_TEST_FAULT=KIND:N  the N-th call of a kind: `file` (files and folders), `print` (standard
///                           output and error), `memory` (allocations), `thread` (new threads)
/// QJULIA_TEST_CALLS=FILE    gets a line "KIND N" for each call; of allocations, for the first that
///                           comes from each place in the program, its callers included; "failed
///                           NAME" for the fault
/// QJULIA_TEST_SPARED=A-B,…  code of the program, hexadecimal offsets, in which nothing fails

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <unwind.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string_view>

// The C library's own, by names that nobody replaces. NOLINTBEGIN(bugprone-reserved-identifier)
extern "C" void* __libc_malloc(size_t size);
extern "C" void* __libc_calloc(size_t count, size_t size);
extern "C" void* __libc_realloc(void* old, size_t size);
extern "C" void* __libc_memalign(size_t alignment, size_t size);
// NOLINTEND(bugprone-reserved-identifier)

namespace {

enum class Kind { file, print, memory, thread };
constexpr std::array<const char*, 4> kKinds = {"file", "print", "memory", "thread"};

/// Where a module's code lies.
struct Module {
  std::uintptr_t begin = 0, end = 0;
  bool contains(std::uintptr_t address) const { return begin <= address && address < end; }
};

Module program;
std::uintptr_t program_base = 0;
std::array<Module, 64> spared;
/// Libraries that are there from the start, but the OpenCL loader.
std::array<Module, 128> libraries;
std::size_t library_count = 0;

bool is_ready = false;
int calls_file = -1;
Kind wanted_kind{};
unsigned long wanted = 0;  ///< 0: none
std::array<std::atomic<unsigned long>, kKinds.size()> counts{};

/// Paths of allocations that were seen, by hash; 0: free.
std::array<std::atomic<std::uint64_t>, 1 << 16> seen{};

int add_module(dl_phdr_info* info, size_t /*size*/, void* /*data*/) {
  Module module;
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& part = info->dlpi_phdr[i];
    if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0) continue;
    module = {info->dlpi_addr + part.p_vaddr, info->dlpi_addr + part.p_vaddr + part.p_memsz};
  }
  const std::string_view name(info->dlpi_name);
  if (name.empty() && program.end == 0) {
    program = module;
    program_base = info->dlpi_addr;
  } else if (name.find("libOpenCL") == std::string_view::npos && library_count < libraries.size()) {
    libraries[library_count++] = module;
  }
  return 0;
}

struct Path {
  bool is_programs = false;  ///< whether the program comes before any driver
  bool is_spared = false;
  std::uint64_t hash = 14695981039346656037U;
  int frames = 0, programs_frames = 0;
};

_Unwind_Reason_Code add_frame(_Unwind_Context* context, void* data) {
  constexpr int kMostFrames = 24, kMostOfProgram = 6;
  auto& path = *static_cast<Path*>(data);
  const std::uintptr_t address = _Unwind_GetIP(context) - 1;
  if (program.contains(address)) {
    path.is_programs = true;
    for (const Module& code : spared) path.is_spared |= code.contains(address);
    ++path.programs_frames;
    path.hash = (path.hash ^ (address - program.begin)) * 1099511628211U;
  } else {
    bool is_library = false;
    for (std::size_t i = 0; i < library_count; ++i) is_library |= libraries[i].contains(address);
    if (!is_library) {  // a driver's, which the program's copies of library functions serve too
      path.is_programs = false;
      return _URC_END_OF_STACK;
    }
  }
  const bool goes_on = ++path.frames < kMostFrames && path.programs_frames < kMostOfProgram;
  return goes_on ? _URC_NO_REASON : _URC_END_OF_STACK;
}

bool is_new(std::uint64_t hash) {
  for (std::size_t i = hash % seen.size();; i = (i + 1) % seen.size()) {
    std::uint64_t there = 0;
    if (seen[i].compare_exchange_strong(there, hash)) return true;
    if (there == hash) return false;
  }
}

template <class... Values>
void tell(const char* format, Values... values) {
  std::array<char, 256> line{};
  const int length = std::snprintf(line.data(), line.size(), format, values...);
  if (calls_file >= 0) ::syscall(SYS_write, calls_file, line.data(), length);
}

/// Whether this call is the one that fails.
bool fails(Kind kind, const char* name) {
  const bool is_counted = wanted == 0 ? calls_file >= 0 : kind == wanted_kind;
  if (!is_ready || !is_counted) return false;
  const auto index = static_cast<std::size_t>(kind);
  if (wanted != 0 && counts[index] >= wanted) return false;
  const int error = errno;
  Path path;
  _Unwind_Backtrace(add_frame, &path);
  errno = error;
  if (!path.is_programs || path.is_spared) return false;
  const unsigned long number = ++counts[index];
  if (wanted == 0) {
    if (kind != Kind::memory || is_new(path.hash)) tell("%s %lu\n", kKinds[index], number);
    return false;
  }
  if (number == wanted) tell("failed %s\n", name);
  return number == wanted;
}

bool fails(Kind kind, const char* name, int error) {
  if (!fails(kind, name)) return false;
  errno = error;
  return true;
}

template <class Function>
Function* next(Function* /*same type*/, const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool is_standard(FILE* stream) { return stream == stdout || stream == stderr; }

void prepare() {
  ::dl_iterate_phdr(add_module, nullptr);
  if (const char* calls = std::getenv("QJULIA_TEST_CALLS")) {
    calls_file = static_cast<int>(
        ::syscall(SYS_openat, AT_FDCWD, calls, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  }
  if (const char* fault = std::getenv("QJULIA_TEST_FAULT")) {
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      const std::size_t length = std::strlen(kKinds[i]);
      if (std::strncmp(fault, kKinds[i], length) != 0) continue;
      wanted_kind = static_cast<Kind>(i);
      wanted = std::strtoul(fault + length + 1, nullptr, 10);
    }
  }
  if (const char* offsets = std::getenv("QJULIA_TEST_SPARED")) {
    for (Module& code : spared) {
      char* end = nullptr;
      code.begin = program_base + std::strtoul(offsets, &end, 16);
      code.end = program_base + std::strtoul(end + 1, &end, 16);
      if (*end != ',') break;
      offsets = end + 1;
    }
  }
  is_ready = true;
}

using Main = int(int, char**, char**);
Main* programs_main = nullptr;

int prepared_main(int argc, char** argv, char** environment) {
  prepare();
  return programs_main(argc, argv, environment);
}

}  // namespace

// NOLINTNEXTLINE(bugprone-reserved-identifier)
extern "C" int __libc_start_main(Main* main, int argc, char** argv, void (*begin)(), void (*end)(),
                                 void (*unload)(), void* stack) {
  programs_main = main;
  using Start = int(Main*, int, char**, void (*)(), void (*)(), void (*)(), void*);
  return next(static_cast<Start*>(nullptr), "__libc_start_main")(prepared_main, argc, argv, begin,
                                                                 end, unload, stack);
}

/// A function of the C library that fails with `error` and gives -1.
#define QJ_FAULTY(kind, error, result, name, parameters, arguments)      \
  extern "C" result name parameters {                                    \
    static const auto real = next(&name, #name);                         \
    if (fails(Kind::kind, #name, error)) return static_cast<result>(-1); \
    return real arguments;                                               \
  }

// NOLINTBEGIN(bugprone-macro-parentheses)
QJ_FAULTY(file, EIO, ssize_t, read, (int file, void* to, size_t size), (file, to, size))
QJ_FAULTY(file, ENOSPC, ssize_t, write, (int file, const void* from, size_t size),
          (file, from, size))
QJ_FAULTY(file, ENOSPC, ssize_t, pwrite, (int file, const void* from, size_t size, off_t at),
          (file, from, size, at))
QJ_FAULTY(file, EIO, int, fsync, (int file), (file))
QJ_FAULTY(file, EIO, int, ftruncate, (int file, off_t size) noexcept, (file, size))
QJ_FAULTY(file, EPERM, int, fchmod, (int file, mode_t mode) noexcept, (file, mode))
QJ_FAULTY(file, EPERM, int, fchown, (int file, uid_t user, gid_t group) noexcept,
          (file, user, group))
QJ_FAULTY(file, ENOLCK, int, flock, (int file, int operation) noexcept, (file, operation))
QJ_FAULTY(file, EIO, int, fstat, (int file, struct stat* info) noexcept, (file, info))
QJ_FAULTY(file, EIO, int, stat, (const char* path, struct stat* info) noexcept, (path, info))
QJ_FAULTY(file, EIO, int, lstat, (const char* path, struct stat* info) noexcept, (path, info))
QJ_FAULTY(file, EIO, int, access, (const char* path, int mode) noexcept, (path, mode))
QJ_FAULTY(file, EIO, off_t, lseek, (int file, off_t to, int from) noexcept, (file, to, from))
QJ_FAULTY(file, EIO, int, rename, (const char* from, const char* to) noexcept, (from, to))
QJ_FAULTY(file, EIO, int, unlink, (const char* path) noexcept, (path))
QJ_FAULTY(file, EIO, int, unlinkat, (int folder, const char* path, int flags) noexcept,
          (folder, path, flags))
QJ_FAULTY(file, ENOSPC, int, mkdir, (const char* path, mode_t mode) noexcept, (path, mode))
// NOLINTEND(bugprone-macro-parentheses)

extern "C" int close(int file) {
  static const auto real = next(&close, "close");
  const bool failed = fails(Kind::file, "close");
  const int result = real(file);  // it is closed all the same: close(2)
  if (failed) errno = EIO;
  return failed ? -1 : result;
}

extern "C" int open(const char* path, int flags, ...) {
  std::va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  static const auto real = next(&open, "open");
  return fails(Kind::file, "open", EMFILE) ? -1 : real(path, flags, mode);
}

extern "C" int openat(int folder, const char* path, int flags, ...) {
  std::va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  static const auto real = next(&openat, "openat");
  return fails(Kind::file, "openat", EMFILE) ? -1 : real(folder, path, flags, mode);
}

extern "C" FILE* fopen64(const char* path, const char* mode) {
  static const auto real = next(&fopen64, "fopen64");
  return fails(Kind::file, "fopen", EMFILE) ? nullptr : real(path, mode);
}

extern "C" dirent* readdir(DIR* folder) {
  static const auto real = next(&readdir, "readdir");
  return fails(Kind::file, "readdir", EIO) ? nullptr : real(folder);
}

extern "C" size_t fwrite(const void* from, size_t size, size_t count, FILE* stream) {
  static const auto real = next(&fwrite, "fwrite");
  const bool failed = is_standard(stream) && fails(Kind::print, "fwrite", EIO);
  return failed ? 0 : real(from, size, count, stream);
}

extern "C" int fputc(int character, FILE* stream) {
  static const auto real = next(&fputc, "fputc");
  const bool failed = is_standard(stream) && fails(Kind::print, "fputc", EIO);
  return failed ? EOF : real(character, stream);
}

extern "C" int fflush(FILE* stream) {
  static const auto real = next(&fflush, "fflush");
  const bool failed = is_standard(stream) && fails(Kind::print, "fflush", EIO);
  return failed ? EOF : real(stream);
}

extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                              void* (*start)(void*), void* argument) {
  static const auto real = next(&pthread_create, "pthread_create");
  return fails(Kind::thread, "pthread_create") ? EAGAIN : real(thread, attributes, start, argument);
}

extern "C" void* mmap(void* at, size_t size, int protection, int flags, int file, off_t offset) {
  static const auto real = next(&mmap, "mmap");
  return fails(Kind::memory, "mmap", ENOMEM) ? MAP_FAILED
                                             : real(at, size, protection, flags, file, offset);
}

extern "C" void* malloc(size_t size) {
  return fails(Kind::memory, "malloc", ENOMEM) ? nullptr : __libc_malloc(size);
}

extern "C" void* calloc(size_t count, size_t size) {
  return fails(Kind::memory, "calloc", ENOMEM) ? nullptr : __libc_calloc(count, size);
}

extern "C" void* realloc(void* old, size_t size) {
  return fails(Kind::memory, "realloc", ENOMEM) ? nullptr : __libc_realloc(old, size);
}

extern "C" void* aligned_alloc(size_t alignment, size_t size) {
  return fails(Kind::memory, "aligned_alloc", ENOMEM) ? nullptr : __libc_memalign(alignment, size);
}

extern "C" int posix_memalign(void** to, size_t alignment, size_t size) {
  if (fails(Kind::memory, "posix_memalign")) return ENOMEM;
  *to = __libc_memalign(alignment, size);
  return *to == nullptr ? ENOMEM : 0;
}
