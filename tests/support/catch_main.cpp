#define CATCH_CONFIG_RUNNER  // Catch2 2 needs it
#include <catch2/catch_all.hpp>

#include "test_device.hpp"

int main(int argc, char** argv) {
  const int failed = Catch::Session().run(argc, argv);
  qjulia::test::kept_device().reset();
  return failed;
}
