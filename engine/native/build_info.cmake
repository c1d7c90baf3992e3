# Run at every build: writes build_facts.inc, and touches it only when something changed.
# Without git (a source archive) the facts stay empty: unknown is said, never guessed.
function(ask variable)
  execute_process(COMMAND ${GIT} -C ${SOURCE} ${ARGN} OUTPUT_VARIABLE answer RESULT_VARIABLE failed
                  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(failed)
    set(answer "")
  endif()
  string(REPLACE "\\" "\\\\" answer "${answer}")
  string(REPLACE "\"" "\\\"" answer "${answer}")
  set(${variable} "${answer}" PARENT_SCOPE)
endfunction()

set(inside "")
if(GIT)
  # The archive may lie inside another repository: the answer counts only if this file is tracked.
  ask(inside ls-files --error-unmatch CMakeLists.txt)
endif()
foreach(fact hash time parents describe shallow count changes)
  set(${fact} "")
endforeach()
set(dirty "")
if(inside)
  ask(hash rev-parse HEAD)
  ask(time show -s --format=%cI HEAD)
  ask(parents show -s --format=%P HEAD)
  ask(describe describe --tags --long --match "[0-9]*" --match "v[0-9]*")
  ask(shallow rev-parse --is-shallow-repository)
  ask(count rev-list --count HEAD)
  execute_process(COMMAND ${GIT} -C ${SOURCE} status --porcelain --untracked-files=no OUTPUT_VARIABLE changes
                  RESULT_VARIABLE failed ERROR_QUIET)
  if(NOT failed)
    set(dirty "false")
    if(changes)
      set(dirty "true")
    endif()
  endif()
endif()
# git archive writes the commit there, and so does .ci/build_backend.py; a mere copy keeps the placeholders. In an
# archive made by the backend the folder engine/ lies one deeper, below the name that is installed.
set(archive "")
foreach(root ${SOURCE}/../.. ${SOURCE}/../../..)
  if(NOT archive AND EXISTS ${root}/.source-archive)
    file(READ ${root}/.source-archive archive)
  endif()
endforeach()
if(NOT hash)
  if(archive MATCHES "node: ([0-9a-f]+)")
    set(hash ${CMAKE_MATCH_1})
    if(archive MATCHES "time: ([0-9T:+Z-]+)")
      set(time ${CMAKE_MATCH_1})
    endif()
    if(archive MATCHES "parents: ([0-9a-f ]+)")
      set(parents ${CMAKE_MATCH_1})
    endif()
    if(archive MATCHES "changed: true")
      set(dirty "true")
    endif()
  endif()
endif()
string(REPLACE "\"" "\\\"" FLAGS "${FLAGS}")
file(WRITE ${OUTPUT}.new "#define SPOOK_GIT_HASH \"${hash}\"
#define SPOOK_DIRTY \"${dirty}\"
#define SPOOK_COMMIT_TIME \"${time}\"
#define SPOOK_PARENTS \"${parents}\"
#define SPOOK_DESCRIBE \"${describe}\"
#define SPOOK_SHALLOW \"${shallow}\"
#define SPOOK_COUNT \"${count}\"
#define SPOOK_COMPILER \"${COMPILER}\"
#define SPOOK_FLAGS \"${FLAGS}\"
#define SPOOK_VERSION \"${VERSION}\"
")
execute_process(COMMAND ${CMAKE_COMMAND} -E copy_if_different ${OUTPUT}.new ${OUTPUT})
