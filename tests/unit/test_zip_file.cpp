// ZIP archives as they are written.

#include <catch2/catch_all.hpp>
#include <sstream>

#include "base/zip_file.hpp"
#include "zip_text.hpp"

using namespace qjulia;

TEST_CASE("a ZIP archive holds what was written, with and without ZIP64") {
  const std::uint64_t most = GENERATE(std::uint64_t{1000}, std::uint64_t{5'000'000'000});
  std::string noise;  // what deflate cannot make smaller
  std::uint32_t state = 1;
  for (int i = 0; i < 300'000; ++i) {
    state = state * 1664525 + 1013904223;
    noise.push_back(static_cast<char>(state >> 24));
  }
  std::stringstream file;
  base::ZipFile zip(file);
  zip.begin("a/first.txt", most) << "one " << 2 << ' ' << 3.5;
  zip.begin("empty", most);
  zip.begin("noise", most) << noise;
  zip.finish();
  const std::string bytes = file.str();
  const auto entries = test::zip_entries(bytes);
  REQUIRE(entries.size() == 3);
  CHECK(entries.at("a/first.txt") == "one 2 3.5");
  CHECK(entries.at("empty").empty());
  CHECK(entries.at("noise") == noise);
  CHECK(test::number_at(bytes, 4, 2) == (most > 1000 ? 45 : 20));  // version to extract it
}
