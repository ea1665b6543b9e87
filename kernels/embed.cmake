# cmake -DROOT=… -DFILES=a;b -DOUTPUT=… -P embed.cmake: writes the files' bytes as C++ arrays.
set(arrays "")
set(table "")
set(index 0)
foreach(file IN LISTS FILES)
  file(READ ${ROOT}/${file} hex HEX)
  string(REGEX REPLACE "(..)" "'\\\\x\\1'," bytes "${hex}")
  string(APPEND arrays "constexpr char kFile${index}[] = {${bytes}'\\0'};\n")
  string(APPEND table "    {\"${file}\", {kFile${index}, sizeof kFile${index} - 1}},\n")
  math(EXPR index "${index} + 1")
endforeach()
file(WRITE ${OUTPUT}.tmp
"// Generated from kernels/ and include/qjulia/shared/; do not edit.
#include \"device/embedded_kernels.hpp\"

namespace qjulia::device {
namespace {
${arrays}}  // namespace

const std::map<std::string, std::string_view, std::less<>>& embedded_kernels() {
  static const std::map<std::string, std::string_view, std::less<>> files = {
${table}  };
  return files;
}
}  // namespace qjulia::device
")
file(RENAME ${OUTPUT}.tmp ${OUTPUT})
