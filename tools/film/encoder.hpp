#pragma once
/// How FFmpeg makes a film of numbered pictures.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia::film {

/// The types of films, such as ".mp4".
const std::vector<std::string>& film_types();

struct Encoding {
  std::filesystem::path frames;  ///< a folder of frame_0001.png and on
  std::filesystem::path output;  ///< of one of the types
  double rate = 25;              ///< pictures a second
  std::size_t pictures = 0;      ///< that there are, from frame_0001.png on
  int times = 1;                 ///< the film shows them all so often, one after the other
  bool is_transparent = false;   ///< keep what shows through, where the type can
  std::string note{};            ///< says how it was made, and is kept as the file's comment
};

/// @throws InputError for pictures that FFmpeg cannot put into a film of this type
void expect_size(const std::filesystem::path& output, int width, int height, bool is_transparent);

/// Whether `PATH` leads to FFmpeg.
bool has_encoder();

/// The words of the command, "ffmpeg" first. https://ffmpeg.org/ffmpeg.html
std::vector<std::string> encoder_words(const Encoding& encoding);

/// "frame_0001.png".
std::string frame_name(std::size_t number);
/// Whether some picture is called so.
bool is_frame_name(std::string_view name);

}  // namespace qjulia::film
