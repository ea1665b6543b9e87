#include "base/output_gate.hpp"

#include <utility>

namespace qjulia::base {
namespace {

thread_local OutputGate* innermost = nullptr;

}  // namespace

OutputGate::OutputGate(std::function<void()> pass)
    : pass_(std::move(pass)), outer_(std::exchange(innermost, this)) {}

OutputGate::~OutputGate() { innermost = outer_; }

void OutputGate::pass() {
  for (const OutputGate* gate = innermost; gate != nullptr; gate = gate->outer_) gate->pass_();
}

}  // namespace qjulia::base
