#pragma once
/// Exceptions by kind. The library throws these; only the command line prints and picks exit codes.

#include <stdexcept>
#include <string>
#include <utility>

namespace qjulia {

/// Base of everything this library throws on purpose.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file or option the caller gave cannot be used; the message names it and says what to do.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A field of an options struct has a value that cannot be used.
class OptionError : public InputError {
 public:
  /// @param field by its name in the struct, such as "max_evaluations".
  /// @param problem what is wrong with it, and what to give.
  OptionError(std::string field, std::string problem)
      : InputError(field + ": " + problem),
        field_(std::move(field)),
        problem_(std::move(problem)) {}
  const std::string& field() const noexcept { return field_; }
  const std::string& problem() const noexcept { return problem_; }

 private:
  std::string field_;
  std::string problem_;
};

/// A result could not be written; nothing was left under its final name.
class OutputError : public Error {
 public:
  using Error::Error;
};

/// A stop was requested, and what had been reached is of no use.
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted") {}
};

/// No OpenCL device matches what was asked for.
class NoDeviceError : public Error {
 public:
  using Error::Error;
};

/// An OpenCL call failed. `code` is OpenCL's error number.
class DeviceError : public Error {
 public:
  DeviceError(const std::string& device, const std::string& call, int error_code);
  int code() const noexcept { return code_; }
  /// Whether the driver has lost the device: after a crash, a launch that a watchdog ended, or a
  /// machine that slept. Only a new Device may work.
  bool is_lost() const noexcept;

 private:
  int code_;
};

/// A kernel did not compile. The message holds the options and the compiler's log.
class KernelBuildError : public Error {
 public:
  using Error::Error;
};

}  // namespace qjulia
