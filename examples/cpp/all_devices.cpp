// Many shapes, fitted on all devices at once: all_devices FACTORS SCHEDULE MESH...
// For example: all_devices 100 tight *.obj
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <qjulia/qjulia.hpp>
#include <thread>

int main(int argc, char** argv) try {
  if (argc < 4) throw qjulia::InputError("usage: all_devices FACTORS SCHEDULE MESH...");
  qjulia::FitOptions options;
  options.factors = std::atoi(argv[1]);
  options.schedule = argv[2];

  std::atomic<int> next{3}, failed{0};
  std::mutex printing;
  const auto say = [&](const auto&... words) {
    const std::lock_guard lock(printing);
    (std::cout << ... << words) << std::endl;
  };
  const auto work = [&](const qjulia::DeviceInfo& info) {
    for (int i = next++; i < argc; i = next++) {
      const std::filesystem::path file = argv[i];
      try {
        // A device is for one thread: each makes its own.
        const auto device = qjulia::Device::choose(
            {std::to_string(info.platform) + ':' + std::to_string(info.index)});
        const auto result = qjulia::fit(device, qjulia::read_mesh(file), options);
        qjulia::write_map(result.map, file.stem().string() + ".qjulia.json");
        say(file.filename().string(), ": ", result.seconds, " s on ", info.name, ", IoU ",
            result.stages.back().iou);
      } catch (const std::exception& error) {
        ++failed;
        say(file.string(), ": ", error.what());
      }
    }
  };
  {
    std::vector<std::jthread> threads;  // they end before the block does
    for (const auto& info : qjulia::list_devices()) threads.emplace_back(work, info);
    if (threads.empty()) throw qjulia::NoDeviceError("no OpenCL device was found");
  }
  return failed == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
