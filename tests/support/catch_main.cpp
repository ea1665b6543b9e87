#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>

#include "test_device.hpp"

int main(int argc, char** argv) {
  const int failed = Catch::Session().run(argc, argv);
  qjulia::test::kept_device().reset();
  return failed;
}
