# Tests that embedding fails if a kernel includes a header that is missing in the list of dependencies.
file(REMOVE_RECURSE ${FOLDER})
file(WRITE ${FOLDER}/common/a.h "#include \"pictura/common/b.h\"\n")
file(WRITE ${FOLDER}/common/b.h "\n")
function(embed dependencies result_out message_out)
  execute_process(COMMAND ${CMAKE_COMMAND} -DROOTS=common/a.h "-DDEPENDENCIES=${dependencies}" -DSOURCE_DIR=${FOLDER}
                          -DOUTPUT=${FOLDER}/out.cpp -P ${SCRIPT}
    RESULT_VARIABLE result ERROR_VARIABLE message)
  set(${result_out} ${result} PARENT_SCOPE)
  set(${message_out} "${message}" PARENT_SCOPE)
endfunction()
embed("${FOLDER}/common/a.h;${FOLDER}/common/b.h" result message)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "expected the sources to be embedded, got: ${message}")
endif()
embed("${FOLDER}/common/a.h" result message)
if(result EQUAL 0 OR NOT message MATCHES "common/b.h: included by the embedded kernels")
  message(FATAL_ERROR "expected common/b.h to be refused, got ${result}: ${message}")
endif()
