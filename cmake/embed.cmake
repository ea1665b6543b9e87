# cmake -DROOT=… -DFILES=a;b -DHEADER=h -DNAMESPACE=n -DFUNCTION=f -DOUTPUT=… -P embed.cmake: writes
# the files' bytes as C++ arrays, and n::f(), a map of them by path, as h declares it.
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
"// Generated; do not edit.
#include \"${HEADER}\"

namespace ${NAMESPACE} {
namespace {
${arrays}}  // namespace

const std::map<std::string, std::string_view, std::less<>>& ${FUNCTION}() {
  static const std::map<std::string, std::string_view, std::less<>> files = {
${table}  };
  return files;
}
}  // namespace ${NAMESPACE}
")
file(RENAME ${OUTPUT}.tmp ${OUTPUT})
