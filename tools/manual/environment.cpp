#include "environment.hpp"

#include <fmt/format.h>

#include <array>

#include "pages.hpp"

namespace qjulia::manual {

std::span<const Entry> environment() {
  static constexpr std::array kEntries = {
      Entry{"QJULIA_DEVICE",
            "Where to compute, as --device takes it: gpu, cpu, P:D or a part of a name. The option "
            "takes precedence.",
            Concern::computing},
      Entry{
          "QJULIA_LAYOUT",
          "How kernels are cut into work-items, as --layout takes it: auto, cpu or gpu. The option "
          "takes precedence.",
          Concern::computing},
      Entry{"QJULIA_TUNING",
            "off: do not use the settings that 'qjulia profile tune' found for the device. on, or "
            "nothing: use them.",
            Concern::computing},
      Entry{"QJULIA_BINARIES",
            "auto, or nothing: keep compiled programs of GPUs and accelerators, and load them "
            "instead of compiling again. on: of CPUs too. off: neither keep nor load any.",
            Concern::computing},
      Entry{"QJULIA_CRASHED_BUILDS",
            "retry: build programs even if a process has ended in that build with the same driver. "
            "skip, or nothing: report an error instead. 'qjulia doctor' always tries again, unless "
            "this says skip.",
            Concern::computing},
      Entry{"PATH", "Folders in which 'qjulia film' looks for ffmpeg.", Concern::all},
      Entry{"XDG_CACHE_HOME",
            "The folder under which tuned settings and compiled programs are kept, in qjulia, and "
            "PoCL's compiled kernels, "
            "in pocl. Without it, or where it is a relative path: $HOME/.cache.",
            Concern::computing},
      Entry{
          "POCL_CACHE_DIR",
          "The folder where PoCL keeps compiled kernels; it takes precedence over XDG_CACHE_HOME.",
          Concern::computing},
      Entry{"POCL_EXTRA_BUILD_FLAGS",
            "Flags that PoCL adds to those of every program; 'qjulia doctor' reports them.",
            Concern::computing},
      Entry{"OCL_ICD_VENDORS",
            "Read by the OpenCL loader: the folder that lists the drivers, or one .icd file, in "
            "place of /etc/OpenCL/vendors. qjulia only checks that it lists a driver.",
            Concern::computing},
      Entry{"OCL_ICD_FILENAMES",
            "Read by Khronos's OpenCL loader: libraries of drivers, beside those that are listed. "
            "If it is set, qjulia does not report an empty list.",
            Concern::computing},
      Entry{"TMPDIR",
            "The folder for temporary files: logs of 'qjulia doctor', and the page that 'qjulia "
            "explore --open' leads the browser with. Default: /tmp.",
            Concern::all},
      Entry{"OMPI_COMM_WORLD_SIZE, PMI_SIZE, PMI_RANK, PMIX_RANK",
            "Set by mpirun and by Slurm. Where one of them is there, 'qjulia fit', 'qjulia film "
            "make' and 'qjulia "
            "batch run' "
            "take part in a run over several processes.",
            Concern::computing},
      Entry{"SLURM_ARRAY_TASK_ID, _MIN, _MAX, _COUNT; PBS_ARRAY_INDEX, PBS_ARRAYID",
            "Set in arrays of jobs. 'qjulia batch run' does the array's shard of a batch then; PBS "
            "does not say how many jobs there are, so that --shard is needed.",
            Concern::computing},
  };
  return kEntries;
}

std::span<const Entry> files() {
  static constexpr std::array kEntries = {
      Entry{"$XDG_CACHE_HOME/qjulia/tuning-*.json, else ~/.cache/qjulia/tuning-*.json",
            "Settings that 'qjulia profile tune' found, one file a device, driver and version. "
            "They may be removed at any time.",
            Concern::computing},
      Entry{"$XDG_CACHE_HOME/qjulia/passed-*.json",
            "Records that a GPU has passed its first self-test, one file a device, driver and "
            "version. They may be removed at any time; the test is then run again.",
            Concern::computing},
      Entry{"$XDG_CACHE_HOME/qjulia/programs",
            "Compiled programs, *.program, 64 MiB at most. A process that ends while a driver "
            "builds a program leaves a file *.building. All of them may be removed at any time.",
            Concern::computing},
      Entry{"/etc/OpenCL/vendors/*.icd",
            "The OpenCL drivers of this machine, read by the OpenCL loader.", Concern::computing},
      Entry{"NAME.qjulia.json",
            "A map. Every command that takes a map also takes a page of 'qjulia share', a picture "
            "(.png) of 'qjulia render' or a scene (.glb) of 'qjulia surface', which hold maps.",
            Concern::all},
      Entry{"MAP.checkpoint",
            "Kept beside a map while it is fitted, for 'qjulia fit --resume'; it goes when the fit "
            "is done.",
            Concern::all},
  };
  return kEntries;
}

bool is_about(const Entry& entry, const tools::CommandUsage& command) {
  return entry.concern == Concern::all || command.has("--device");
}

std::string environment_page() {
  std::string text =
      "# Environment variables\n\n"
      "What `qjulia` reads from its environment. This page and the manual pages are made of one "
      "table,\n`tools/manual/environment.cpp`; `cmake --build --preset release --target reference` "
      "makes it again.\n\n| variable | what it does |\n|---|---|\n";
  for (const Entry& entry : environment()) {
    text += fmt::format("| `{}` | {} |\n", entry.name, entry.text);
  }
  text +=
      "\nNo command writes colours, on a terminal or elsewhere, so there is nothing that "
      "`NO_COLOR` "
      "could turn off.\nA progress bar is drawn where standard error is a terminal; elsewhere "
      "there "
      "is a line now and then, and with\n`--quiet` nothing.\n\n"
      "Tests and the build have variables of their own, `QJULIA_TEST_…`, which the command does "
      "not "
      "read.\n\n## Files\n\n| file | what it is |\n|---|---|\n";
  for (const Entry& entry : files()) text += fmt::format("| `{}` | {} |\n", entry.name, entry.text);
  return text;
}

}  // namespace qjulia::manual
