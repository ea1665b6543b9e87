#!/usr/bin/env python3
"""What a compiler can prove about the kernels on GPUs where there is no GPU.

usage: gpu.py REPOSITORY [--compile] [--write] [--table=FILE] [--loops] [--markdown]

Compiles every program as GPUs use it (one lane, groups of 64) for AMD, NVIDIA and SPIR-V, in single
and double precision, and checks that
  * no function is left undefined, and none is called;
  * no array lies in private memory;
  * no kernel has more scratch or fewer waves than gpu_kernels.txt says, where a kernel and a precision
    have a line: the waves for each target, and after a / the bytes of scratch where there are any;
  * NVIDIA's own assembler, ptxas, where there is one ($PTXAS, PATH, $CUDA_HOME or $CUDA_PATH,
    /usr/local/cuda), takes them for sm_80, sm_90 and sm_120 without a spill;
  * Intel's own compiler, where Debian's ocloc of intel-opencl-icd is there ($OCLOC, PATH), takes them
    for Gen12, Arc and Ponte Vecchio; their "waves" are the lanes of a thread;
  * the instructions of the loops that take the time are those of host/profile/instruction_counts.hpp.
The figures are of Clang 15 (Debian 12). Another Clang counts otherwise: with it, kernels must
compile, and must neither call functions nor have arrays in private memory.
gpu_kernels.txt also has a digest of everything the figures follow from: the kernels, this script, the
counts, the compiler. Where it is the same, the figures are too, and nothing is compiled unless
--compile or another option asks for it.
--write rewrites gpu_kernels.txt and the figures in instruction_counts.hpp. --table writes all figures,
registers and local memory too, into a file; --loops prints the loops of every kernel, --markdown the
table of docs/lab/performance.md.
"""

import collections
import concurrent.futures
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# The first of these that is installed is used; the table was made with the first.
CLANGS = ("clang-15", "clang-19")
CLANG = next((name for name in CLANGS if shutil.which(name)), CLANGS[0])
CLC = "/usr/lib/clc/"
COMMON = ["-x", "cl", "-cl-std=CL1.2", "-O2", "-Xclang", "-finclude-default-header", "-Ikernels",
          "-DQJ_WIDTH=1", "-S", "-o", "-"]
# Of a compute unit: registers a lane of a SIMD has for all its waves, how many are handed out at a
# time, most waves, lanes of a wave. Four (gfx1030: two) SIMDs share 64 KiB of local memory.
Gpu = collections.namedtuple("Gpu", "registers granule waves lanes simds")
GPUS = {"gfx906": Gpu(256, 4, 10, 64, 4),
        "gfx90a": Gpu(512, 8, 8, 64, 4),
        "gfx1030": Gpu(1024, 16, 16, 32, 2)}
LOCAL_BYTES = 65536
OTHERS = ("nvptx64", "spir64")
# Of a multiprocessor, which has four schedulers, 65,536 registers and hands them out by 8 to each
# of 32 lanes: most warps, most groups, shared memory in bytes (CUDA C++ Programming Guide, Compute
# Capabilities), of which each group takes 1 KiB more than it asks for.
Sm = collections.namedtuple("Sm", "warps groups shared")
SMS = {"sm_80": Sm(64, 32, 164 << 10), "sm_90": Sm(64, 32, 228 << 10),
       "sm_120": Sm(48, 24, 100 << 10)}
# Whether they have double precision.
INTELS = {"tgllp": False, "dg2": False, "pvc": True}
SCHEDULERS = 4
LANES = 32
# Programs that know one of these options are compiled with each of its values.
OPTIONS = {"QJ_GROUP": (64,)}
REPOSITORY = pathlib.Path(next(a for a in sys.argv[1:] if not a.startswith("--")))


def kinds_of_maps():
    """Each kind of modulus or versor except `factors`, with the -D options that select its files."""
    kinds = {}
    for role in ("modulus", "versor"):
        for file in sorted((REPOSITORY / "kernels").glob(f"*_{role}.clh")):
            kind = file.name.removesuffix(f"_{role}.clh")
            if kind != "factors":
                kinds.setdefault(kind, []).append(f'-DQJ_{role.upper()}="{file.name}"')
    return kinds


# What builds a program for a kind of map. Rows of such programs end in + and the kind's name.
MAPS = {"portals": ['-DQJ_PORTALS="portals.clh"'], "paint": ['-DQJ_PAINT="painted.clh"'],
        **kinds_of_maps()}
OF_MAPS = {"field", "field_queries", "level_set", "orbit_trait", "ray_march"}
# Loops that take the time, by the name their figures have: kernel, and the rank of the loop among
# the kernel's by multiply-adds.
HOT_LOOPS = {"log_norm": ("energy_terms", 3),
             "versor": ("energy_terms", 1),
             "potential_gradient": ("gradient_potential", 0),
             "step": ("gradient_orbit", 2),
             "pull_back": ("gradient_orbit", 0),
             "pull_back_last": ("gradient_orbit", 5)}
KINDS = ("fma", "special", "loads", "other")


def includes(path, seen=None):
    """The text of a program with all that it includes."""
    seen = set() if seen is None else seen
    if path in seen:
        return ""
    seen.add(path)
    text = path.read_text()
    for name in re.findall(r'#include "(.+)"', text):
        text += includes(pathlib.Path("kernels") / name, seen)
    return text


def builds(program):
    """The lists of -D a GPU builds a program with."""
    text = includes(program)
    lists = [[]]
    for option, values in OPTIONS.items():
        if re.search(rf"\b{option}\b", text):
            lists = [defines + [f"-D{option}={v}"] for defines in lists for v in values]
    return lists


def merged(programs, folder):
    """Sources of many programs each, and the lists of -D they are built with."""
    def source(name, some):
        path = pathlib.Path(folder, name + ".cl")
        path.write_text("".join(f'#include "{program.name}"\n' for program in some))
        return path
    yield source("all", programs), [f"-D{option}={v}" for option, values in OPTIONS.items()
                                    for v in values]
    of_maps = source("of_maps", [program for program in programs if program.stem in OF_MAPS])
    yield from ((of_maps, defines) for defines in MAPS.values())


def kind_of_map(defines):
    """"+noise" where a program was built for maps with noise; "" for maps of factors."""
    return "".join("+" + name for name, of in MAPS.items() if set(of) <= set(defines))


def compile_for(job):
    program, target, double, defines, further = job
    if target in GPUS:
        to = ["--target=amdgcn--amdhsa", f"-mcpu={target}", "-nogpulib", "-Xclang",
              "-mlink-builtin-bitcode", "-Xclang", CLC + "amdgcn--amdhsa.bc"]
    elif target == "nvptx64":
        to = ["--target=nvptx64--nvidiacl", "-Xclang", "-mlink-builtin-bitcode", "-Xclang",
              CLC + "nvptx64--nvidiacl.bc"]
    else:
        to = ["--target=spir64-unknown-unknown", "-emit-llvm"]
    command = [CLANG, *to, *COMMON, f"-DQJ_DOUBLE={double}", *defines, *further, str(program)]
    run = subprocess.run(command, capture_output=True, text=True)
    return run.stdout if run.returncode == 0 else None, run.stderr


def kernels_of_amd(text):
    """Name -> registers, scratch, local bytes, lanes of a group."""
    found = {}
    groups = {name: int(size) for size, name in
              re.findall(r"\.max_flat_workgroup_size: (\d+)\n    \.name: +'?(\w+)", text)}
    pattern = (r"\.amdhsa_kernel (\w+)\n.*?; NumVgprs: (\d+).*?; ScratchSize: (\d+)"
               r".*?; LDSByteSize: (\d+)")
    for name, *figures in re.findall(pattern, text, re.S):
        found[name] = (*map(int, figures), groups[name])
    return found


def occupancy(gpu, registers, local, group):
    """Waves a SIMD can have at a time."""
    given = -(-max(registers, 1) // gpu.granule) * gpu.granule
    waves = min(gpu.waves, gpu.registers // given)
    if local > 0:
        waves = min(waves, LOCAL_BYTES // local * -(-group // gpu.lanes) // gpu.simds)
    return waves


def warps(sm, registers, shared, group):
    """Warps a scheduler can have at a time."""
    given = -(-max(registers, 1) // 8) * 8
    most = min(sm.warps // SCHEDULERS, (65536 // SCHEDULERS) // (LANES * given))
    groups = min(sm.groups, sm.shared // (shared + 1024))
    return min(most, groups * -(-group // LANES) // SCHEDULERS)


def find_ptxas():
    """NVIDIA's assembler; None where there is none."""
    folders = [os.environ[name] for name in ("CUDA_HOME", "CUDA_PATH") if os.environ.get(name)]
    named = [os.environ["PTXAS"]] if os.environ.get("PTXAS") else []
    for place in named + ["ptxas"] + [f"{folder}/bin/ptxas" for folder in folders + ["/usr/local/cuda"]]:
        if found := shutil.which(place):
            return found
    return None


def assembled(job):
    """What ptxas says of each kernel: name -> registers, bytes of stack, shared bytes, spilled bytes;
    and its whole log where it refuses."""
    ptxas, ptx, arch = job
    with tempfile.NamedTemporaryFile("w", suffix=".ptx") as file:
        file.write(ptx)
        file.flush()
        run = subprocess.run([ptxas, "-v", f"-arch={arch}", file.name, "-o", os.devnull],
                             capture_output=True, text=True)
    if run.returncode != 0:
        return None, run.stdout + run.stderr
    pattern = (r"Compiling entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores, "
               r"(\d+) bytes spill loads\n.*?Used (\d+) registers([^\n]*)")
    found = {}
    for name, frame, stores, loads, registers, rest in re.findall(pattern, run.stdout + run.stderr,
                                                                   re.S):
        shared = re.search(r"(\d+) bytes smem", rest)
        found[name] = (int(registers), int(frame), int(shared[1]) if shared else 0,
                       int(stores) + int(loads))
    return found, ""


def compiled_by_ocloc(job):
    """What Intel's compiler makes of each kernel: name -> registers, scratch, local bytes, lanes of a
    thread; and its whole log where it refuses."""
    ocloc, source, device, double, defines = job
    options = f"-cl-std=CL1.2 -I{os.path.abspath('kernels')} -DQJ_WIDTH=1 -DQJ_DOUBLE={double}"
    with tempfile.TemporaryDirectory() as folder:
        # It takes no quotes on its command line.
        whole = pathlib.Path(folder, "whole.cl")
        settings = [define[2:].replace("=", " ", 1) for define in defines]
        whole.write_text("".join(f"#define {setting}\n" for setting in settings) + source.read_text())
        run = subprocess.run([ocloc, "compile", "-q", "-file", str(whole), "-device", device,
                              "-out_dir", folder, "-output", "made", "-output_no_suffix", "-options",
                              options, "-internal_options", "-cl-intel-allow-zebin"],
                             capture_output=True, text=True)
        made = pathlib.Path(folder, "made")
        data = made.read_bytes() if run.returncode == 0 and made.exists() else b""
    begin = data.find(b"kernels:\n")  # its section .ze_info, which is YAML
    if begin < 0:
        return None, run.stdout + run.stderr
    text = data[begin:data.index(b"\0", begin)].decode(errors="replace")
    found = {}
    for part in re.split(r"\n  - name: +", "\n" + text.split("kernels_misc_info:")[0])[1:]:
        def figure(name):
            told = re.search(rf"{name}: +(\d+)", part)
            return int(told[1]) if told else 0
        scratch = re.findall(r"type: +scratch\n(?:\s+\w+: +[a-z]\w*\n)*\s+size: +(\d+)", part)
        found[part.split()[0]] = (figure("grf_count"), sum(map(int, scratch)), figure("slm_size"),
                                  figure("simd_size"))
    return found, ""


def intel_rows(ocloc, sources, amd_rows, pool):
    """Rows of the table for Intel, and what is wrong. `sources`: pairs of a merged source and its list
    of -D."""
    programs = {}
    for _, precision, stem, name, *_ in amd_rows:
        programs.setdefault((precision, name), set()).add(stem)
    jobs = [(ocloc, source, device, double, defines) for source, defines in sources
            for device, has_double in INTELS.items() for double in range(1 + has_double)]
    rows, wrong = [], []
    for (_, _, device, double, defines), (found, log) in zip(jobs, pool.map(compiled_by_ocloc, jobs)):
        precision = "double" if double else "single"
        if found is None:
            wrong.append(f"{device} in {precision} {defines}: ocloc refuses\n{log}")
            continue
        for name, figures in found.items():
            kind = kind_of_map(defines)
            stems = [s for s in programs.get((precision, name), ())
                     if s.endswith(kind) and ("+" in s) == bool(kind)]
            rows += [(device, precision, stem, name, *figures) for stem in stems[:1]]
    return rows, wrong


def nvidia_rows(ptxas, compiled, amd_rows, groups, pool):
    """Rows of the table for NVIDIA, and what is wrong. `compiled`: pairs of a job for nvptx64 and its
    PTX. Merged sources do not say which program a kernel is of: the rows for AMD do."""
    supported = subprocess.run([ptxas, "--help"], capture_output=True, text=True).stdout
    programs = {(precision, name): set() for _, precision, _, name, *_ in amd_rows}
    for _, precision, stem, name, *_ in amd_rows:
        programs[precision, name].add(stem)
    jobs = [(job, arch, (ptxas, text, arch)) for arch in SMS if f"'{arch}'" in supported
            for job, text in compiled]
    rows, wrong = [], [f"this ptxas knows no {arch}" for arch in SMS if f"'{arch}'" not in supported]
    for (job, arch, _), (found, log) in zip(jobs, pool.map(assembled, [j for *_, j in jobs])):
        precision = "double" if job[2] else "single"
        if found is None:
            wrong.append(f"{arch} in {precision} {job[3]}: ptxas refuses\n{log}")
            continue
        kind = kind_of_map(job[3])
        for name, (registers, frame, shared, spilled) in found.items():
            stems = [s for s in programs.get((precision, name), ())
                     if s.endswith(kind) and ("+" in s) == bool(kind)]
            if not stems:
                continue  # a kind of map that nobody builds this program for
            if spilled:
                wrong.append(f"{name} for {arch} in {precision} spills {spilled} bytes")
            rows.append((arch, precision, stems[0], name, registers, frame, shared,
                         warps(SMS[arch], registers, shared, groups[name])))
    return rows, wrong


def faults(target, double, text):
    """What must not be in compiled code. In double precision functions may be called and have
    private memory: libclc's, which stand in for a driver's own, are too large to be inlined."""
    if target == "spir64":
        # OpenCL's own functions have mangled names.
        called = re.findall(r"^declare .*?@([\w.]+)\(", text, re.M)
        yield from (f"{name} is undefined" for name in called
                    if not re.match(r"_Z|llvm\.|__", name))
        return
    if target == "nvptx64":
        yield from (f"{name} is undefined" for name in
                    re.findall(r"\.extern \.func\s*(?:\(.*?\)\s*)?(\w+)", text))
        called = re.findall(r"call(?:\.uni)?\s*(?:\(\w+\),)?\s*(\w+),", text)
        private = re.findall(r"\.local .*__local_depot\d+\[(\d+)\]", text)
    else:
        called = re.findall(r"s_add_u32 .*, (\w+)@(?:rel32|gotpcrel32)@lo", text)
        called = called if "s_swappc" in text else []
        private = []  # scratch, in the table
    if not double:
        yield from (f"{name} is called" for name in called)
        yield from (f"{size} bytes of private memory" for size in private)


def kind(instruction):
    name, _, rest = instruction.partition(" ")
    if re.match(r"v_(rcp|rsq|sqrt|log|exp|sin|cos)_", name) or re.match(
            r"(rsqrt|sqrt|rcp|div|lg2|ex2|sin|cos)\.", name):
        return "special"
    if re.match(r"v_(fma|mad|mac|mul|add|sub|subrev|fmac|div_fmas)\w*_f(32|64)", name) or re.match(
            r"(fma|mul|add|sub)\.(rn\.|ftz\.)*f(32|64)", name):
        return "fma"
    if re.match(r"(global_load|s_load|ds_read|buffer_load|flat_load|ld\.)", name):
        return "loads"
    if re.match(r"(v_|s_(?!waitcnt|nop)|ds_|global_|[a-z]+[0-9]*\.)", name):
        return "other"
    return None


def loops_of(text):
    """Kernel -> counts of each loop's own instructions, most multiply-adds first. An assembly says
    beside each block which loop it belongs to."""
    loops = {}
    kernel = header = None
    for line in text.splitlines():
        begin = re.match(r"(?:\.visible )?(?:\.entry )?(\w+)(?::\s*; @\w+|\($)", line)
        if begin:
            kernel, header = begin[1], None
            loops[kernel] = collections.defaultdict(collections.Counter)
            continue
        if re.match(r"(\.LBB|\$L__BB|; %bb|// %bb)", line):
            label = re.match(r"\S*?(BB\d+_\d+)", line)
            inside = re.search(r"in Loop: Header=(BB\d+_\d+)", line)
            header = inside[1] if inside else None
            waits = label[1] if label and not inside else None
        if kernel and "Loop Header: Depth" in line and "Child" not in line and waits:
            header = waits
        instruction = line.strip()
        if kernel and header and line[:1] in "\t " and (found := kind(instruction)):
            loops[kernel][header][found] += 1
    return {name: sorted(all.values(), key=lambda c: -c["fma"]) for name, all in loops.items()}


def table_line(row):
    return "{:8} {:6} {:22} {:28} {:>9} {:>7} {:>6} {:>5}".format(*row)


def limits_text(rows):
    """gpu_kernels.txt: of each kernel and precision, waves and scratch for each target."""
    targets = [*GPUS, *SMS, *INTELS]
    limits = {}
    for target, precision, program, name, _, scratch, _, waves in rows:
        limits.setdefault((precision, program, name), {})[target] = f"{waves}/{scratch}" if scratch else f"{waves}"
    line = "{:6} {:22} {:28}" + " {:>8}" * len(targets)
    lines = [line.format("real", "program", "kernel", *targets)]
    lines += [line.format(*key, *(figures.get(target, "-") for target in targets))
              for key, figures in sorted(limits.items())]
    return "\n".join(lines)


def kept_limits(lines):
    """Target, precision, program and kernel -> scratch and waves, as gpu_kernels.txt says."""
    _, _, _, *targets = lines[0].split()
    limits = {}
    for line in lines[1:]:
        if line.startswith("#"):
            continue
        precision, program, name, *figures = line.split()
        for target, figure in zip(targets, figures):
            if figure != "-":
                waves, _, scratch = figure.partition("/")
                limits[target, precision, program, name] = int(scratch or 0), int(waves)
    return limits


def counts_text(loops):
    lines = []
    for name, (kernel, rank) in HOT_LOOPS.items():
        c = loops[kernel][rank]
        words = "".join(part.capitalize() for part in name.split("_"))
        lines.append(f"constexpr LoopCounts k{words}{{" +
                     ", ".join(f".{k} = {c[k]}" for k in KINDS) + "};")
    return "\n".join(lines)


def digest(counts):
    """Of everything that the table follows from; `counts` is the text of instruction_counts.hpp."""
    version = subprocess.run([CLANG, "--version"], capture_output=True, text=True).stdout
    hashed = hashlib.sha256((version.splitlines()[0] + counts).encode())
    for path in [pathlib.Path(__file__), *sorted(pathlib.Path("kernels").rglob("*")),
                 *sorted(pathlib.Path(CLC).glob("*.bc"))]:
        if path.is_file():
            hashed.update(path.name.encode() + path.read_bytes())
    return hashed.hexdigest()


def main():
    flags = {a for a in sys.argv[1:] if a.startswith("--")}
    if "--write" in flags and CLANG != CLANGS[0]:
        print(f"{CLANGS[0]} was not found; the table is made with it")
        return 2
    os.chdir(REPOSITORY)
    table_path = pathlib.Path("tests/lint/gpu_kernels.txt")
    header_path = pathlib.Path("host/profile/instruction_counts.hpp")
    kept_lines = table_path.read_text().splitlines()
    kept = kept_limits(kept_lines)
    kept_rows = [(*key, "-", scratch, "-", waves) for key, (scratch, waves) in kept.items()]
    if not flags and f"# digest {digest(header_path.read_text())}" in kept_lines:
        print("kernels, compiler and script are those that the table was made with")
        return 0
    programs = sorted(pathlib.Path("kernels").glob("*.cl"))
    jobs = [(program, target, double, defines, ())
            for program in programs
            for defines in builds(program) + (list(MAPS.values()) if program.stem in OF_MAPS else [])
            for double in (0, 1) for target in GPUS]
    # One pair a trip, so that instructions of a loop are those of a pair.
    kernels = re.compile(r"\b(" + "|".join(kernel for kernel, _ in HOT_LOOPS.values()) + r")\(")
    counted = [(program, "gfx906", 0, defines, ("-fno-unroll-loops",))
               for program in programs
               if "--loops" in flags or kernels.search(program.read_text())
               for defines in builds(program)]
    with (tempfile.TemporaryDirectory() as folder,
          concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool):
        # What is not counted is compiled in few sources, which saves half the time.
        sources = list(merged(programs, folder))
        jobs += [(source, target, double, defines, ()) for source, defines in sources
                 for double in (0, 1) for target in OTHERS]
        results = list(pool.map(compile_for, jobs + counted))
        amd_rows = [(target, "double" if double else "single",
                     program.stem + kind_of_map(defines), name)
                    for (program, target, double, defines, further), (text, _)
                    in zip(jobs + counted, results) if target in GPUS and text and not further
                    for name in kernels_of_amd(text)]
        if ocloc := shutil.which(os.environ.get("OCLOC") or "ocloc"):
            intels, refused = intel_rows(ocloc, sources, amd_rows, pool)

    failed = False
    rows, loops, ptx, groups = [], {}, [], {}
    for job, (text, log) in zip(jobs + counted, results):
        program, target, double, defines, further = job
        precision = "double" if double else "single"
        place = " ".join([f"{program} for {target} in {precision}", *defines])
        if text is None:
            print(f"{place}: does not compile\n{log}")
            failed = True
            continue
        if further:
            loops.update(loops_of(text))
            continue
        for fault in sorted(set(faults(target, double, text))):
            print(f"{place}: {fault}")
            failed = True
        if target == "nvptx64":
            ptx.append((job, text))
        if target in GPUS:
            for name, (registers, scratch, local, group) in kernels_of_amd(text).items():
                waves = occupancy(GPUS[target], registers, local, group)
                stem = program.stem + kind_of_map(defines)
                rows.append((target, precision, stem, name, registers, scratch, local, waves))
                groups[name] = min(group, 256)
    version = kept_version = next((l for l in kept_lines if l.startswith("# ptxas")), "# ptxas none")
    if ptxas := find_ptxas():
        told = subprocess.run([ptxas, "--version"], capture_output=True, text=True).stdout
        version = "# ptxas " + re.search(r"V([\d.]+)", told)[1]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            more, wrong = nvidia_rows(ptxas, ptx, list(rows), groups, pool)
        rows += more
        print("\n".join(wrong), end="\n" if wrong else "")
        failed |= any("spills" in fault or "refuses" in fault for fault in wrong)
    else:
        print("ptxas was not found ($PTXAS, PATH, $CUDA_HOME, $CUDA_PATH, /usr/local/cuda): registers "
              "and spills on NVIDIA's cards are not checked")
        rows += [row for row in kept_rows if row[0] in SMS]
    if ocloc:
        rows += intels
        print("\n".join(refused), end="\n" if refused else "")
        failed |= bool(refused)
    else:
        print("ocloc was not found ($OCLOC, PATH): scratch on Intel's GPUs is not checked")
        rows += [row for row in kept_rows if row[0] in INTELS]
    head = table_line(("target", "real", "program", "kernel", "registers", "scratch", "local",
                       "waves"))
    for flag in flags:
        if flag.startswith("--table="):
            pathlib.Path(flag.removeprefix("--table=")).write_text(
                "\n".join([head, *map(table_line, rows), version]) + "\n")
    if "--loops" in flags:
        for name, found in loops.items():
            for counts in found:
                print(f"{name:28}", *(f"{k} {counts[k]:4}" for k in KINDS))
    if "--markdown" in flags:
        others = {tuple(row[:4]): row for row in rows}
        for target, precision, program, name, *figures in rows:
            if (target, precision) == ("gfx906", "single"):
                more = [others.get((sm, precision, program, name)) for sm in SMS]
                print(f"| {name} |", " | ".join(map(str, figures)), "|",
                      " | ".join(f"{row[4]}, {row[7]}" if row else "" for row in more), "|")
    if "--write" in flags and not failed:
        counts = re.sub(r"(?<=// counted\n).*(?=\n// end)", counts_text(loops),
                        header_path.read_text(), flags=re.S)
        header_path.write_text(counts)
        table_path.write_text(f"{limits_text(rows)}\n{version}\n# digest {digest(counts)}\n")
        print(f"wrote {table_path} and {header_path}")
        return 0
    if CLANG != CLANGS[0]:
        print(f"{len(jobs)} compilations; the table is of {CLANGS[0]}, and {CLANG} counts otherwise: its figures are "
              "not compared")
        return 1 if failed else 0

    changes = 0
    for *key, _, scratch, _, waves in rows:
        before = kept.pop(tuple(key), None)
        if (scratch, waves) == before:
            continue
        changes += 1
        told = f"{before[1]} waves, {before[0]} bytes of scratch" if before else "no such kernel"
        print(f"{' '.join(key)}: {waves} waves, {scratch} bytes of scratch; before: {told}")
        # libclc's functions in double precision spill, but a kernel that did not must not begin to.
        most = before[0] if before else (0 if key[1] == "single" else scratch)
        # Another ptxas counts otherwise; what it spills was reported above.
        is_comparable = key[0] not in SMS or version == kept_version
        if scratch > most and is_comparable:
            print("  it has more scratch")
            failed = True
        if before and waves < before[1] and is_comparable:
            print("  fewer waves fit")
            failed = True
    for key in kept:
        changes += 1
        print("gone:   " + " ".join(key))
    if counts_text(loops) not in header_path.read_text():
        changes += 1
        print(f"{header_path} has other instructions than the compiled loops:\n"
              f"{counts_text(loops)}")
        failed = True
    if changes:
        print(f"{changes} changes; where they are meant: tests/lint/gpu.py . --write")
    print(f"{len(jobs)} compilations, {len(rows)} kernels")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
