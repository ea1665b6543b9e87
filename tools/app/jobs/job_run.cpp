#include "jobs/job_run.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

std::vector<std::string> words_on(const Job& job, const std::string& output,
                                  const TrustedDevice& device) {
  const CommandUsage usage = command_usage(job.command);
  std::vector<std::string> words = words_of(job, usage, output);
  if (!usage.has("--device")) return words;
  if (!device.name.empty()) words.insert(words.end(), {"--device", device.name});
  if (!device.layout.empty()) words.insert(words.end(), {"--layout", device.layout});
  if (device.is_trusted) words.emplace_back("--trust-device");
  return words;
}

}  // namespace

JobRun::JobRun(const Job& job, const std::string& output, const TrustedDevice& device)
    : program_(kProgramDescription, "qjulia") {
  describe(program_, chosen_);
  program_.parse(words_on(job, output, device));
}

Plan JobRun::plan() const { return chosen_.plan ? chosen_.plan() : Plan{}; }

int JobRun::run(Session& session) const { return run_planned(chosen_, session); }

Said run_job(const Job& job, const std::string& output, JobPlace place,
             const std::optional<Job>& kept) {
  const JobRun ready(job, output);
  Said said;
  Session session(std::move(place), said);
  session.begin(kept.value_or(ready.kept()));
  const int code = ready.run(session);
  if (code == kInterrupted) throw Interrupted();
  if (code != kDone) throw Error(fmt::format("the job '{}' failed", job.command));
  return said;
}

}  // namespace qjulia::tools
