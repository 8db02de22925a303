#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the build into a temporary folder and uses it from there, away from its prefix, as third-party programs do:
# - no installed text file names the source or the build folder, or a library by its absolute path;
# - every public header compiles with only its own library's pkg-config flags;
# - consumer.cpp, which uses all libraries, links by pkg-config and runs;
# - the CMake lines of the guide for C++, with each library in turn, build and run use_LIBRARY.cpp.
# The same CMake projects are then built with shared libraries (see below).
# Usage: install_test.sh BUILD SOURCE PREFIX LIBDIR STATIC-OR-SHARED COMPILER...
set -eu
build=$1 source=$2 prefix=$3 libdir=$4 kind=$5
shift 5
libraries='base stream cluster matching tri terrain'

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
meson install -C "$build" --no-rebuild --quiet --destdir "$folder/root"
installed=$folder/root$prefix
export PKG_CONFIG_PATH="$installed/$libdir/pkgconfig"
# The installation is not at its prefix, even if the build was not set up with relocatable files.
flags() { pkg-config --define-variable=prefix="$installed" "$@"; }
fail() { echo "install_test: $*"; exit 1; }

# No installed file may contain a path of the build machine.
! grep -rIlF -e "$source" -e "$build" "$installed" || fail 'these installed files name the source or the build folder'
for library in $libraries; do
  if sed -E '/^prefix=/d; s/\$\{[a-z]+\}[^ ]*//g' "$installed/$libdir/pkgconfig/terrace-$library.pc" | grep -E '(^|[ =])(-[LI])?/'; then
    fail "terrace-$library.pc has an absolute path"
  fi
done
! grep -E '[" ;]/' "$installed/$libdir"/cmake/terrace/*.cmake || fail 'the CMake package has an absolute path'

for file in man/man1/terrace.1 man/man1/terrace-mesh.1 bash-completion/completions/terrace zsh/site-functions/_terrace \
  fish/vendor_completions.d/terrace.fish; do
  [ -s "$installed/share/$file" ] || fail "share/$file is not installed"
done

for library in $libraries; do
  (cd "$source/lib$library/include" && find . -name '*.hpp') | sed 's,^\./,,' | sort >"$folder/expected"
  (cd "$installed/include" && find "terrace/$library" -name '*.hpp') | sort >"$folder/found"
  diff "$folder/expected" "$folder/found" || fail "the installed headers of $library differ"
  sed 's,.*,#include <&>,' "$folder/found" >"$folder/headers.cpp"
  # shellcheck disable=SC2046  # flags are words
  "$@" $(flags --cflags "terrace-$library") -fsyntax-only "$folder/headers.cpp"
done

if [ "$kind" = static ]; then static=--static; else static=; fi
# shellcheck disable=SC2046,SC2086
"$@" "$source/tests/install/consumer.cpp" -o "$folder/consumer" \
  $(flags --cflags --libs $static terrace-terrain terrace-stream terrace-cluster terrace-matching terrace-tri)
mkdir "$folder/work"
LD_LIBRARY_PATH="$installed/$libdir" "$folder/consumer" "$folder/work"

command -v cmake >/dev/null || fail 'cmake is missing'
# with_cmake NAME PREFIX: for each library, the lines of each ```cmake block of the guide that find
# and link it build a separate program of one project. The project is configured without other
# installations of terrace, which would hide errors.
with_cmake() {
  project=$folder/project-$1
  mkdir "$project"
  cat >"$project/CMakeLists.txt" <<'CMAKE'
cmake_minimum_required(VERSION 3.16)
project(stranger CXX)
CMAKE
  for library in $libraries; do
    awk -v stem="$project/${library}_" '/^```cmake$/ { n += 1; file = stem n ".cmake"; next } /^```$/ { file = "" }
      file && /^(find_package|pkg_check_modules|target_link_libraries)/ { print > file }' "$source/docs/guides/cpp.md"
    [ -f "$project/${library}_2.cmake" ] || fail "docs/guides/cpp.md does not have two blocks of CMake"
    upper=$(echo "$library" | tr '[:lower:]' '[:upper:]')
    for block in "$project/${library}"_*.cmake; do
      target=$(basename "$block" .cmake)
      mkdir "$project/$target"
      {
        echo "add_executable($target \"$source/tests/install/use_$library.cpp\")"
        sed "s/heights/$target/; s/terrace-terrain/terrace-$library/; s/TERRACE_TERRAIN/TERRACE_$upper/g
          s/COMPONENTS terrain/COMPONENTS $library/; s/terrace::terrain/terrace::$library/" "$block"
      } >"$project/$target/CMakeLists.txt"
      echo "add_subdirectory($target)" >>"$project/CMakeLists.txt"
    done
  done
  PKG_CONFIG_PATH="$2/$libdir/pkgconfig" cmake -S "$project" -B "$project/build" -DCMAKE_PREFIX_PATH="$2" \
    -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE= -Wdev -Werror=dev >"$project/log" 2>&1 &&
    cmake --build "$project/build" --parallel 2 >>"$project/log" 2>&1 || { tail -n 60 "$project/log"; fail "$1"; }
  for block in "$project"/*_[0-9].cmake; do
    target=$(basename "$block" .cmake)
    LD_LIBRARY_PATH="$2/$libdir" "$project/build/$target/$target" || fail "$1: $target failed"
  done
}
for compiler; do case $compiler in *ccache) ;; *) break ;; esac; done
with_cmake "$kind" "$installed"

# A build of shared libraries differs in the lists of libraries that programs link. The shared
# libraries are made from the existing objects.
if [ "$kind" = static ]; then
  meson setup "$folder/shared-build" "$source" -Ddefault_library=shared -Dunity=on -Dprefix="$prefix" -Dlibdir="$libdir" -Dterrace_tests=disabled \
    -Dterrace_python=disabled -Dterrace_bench=disabled -Dbuildtype=plain >"$folder/log" 2>&1 || { tail -n 30 "$folder/log"; exit 1; }
  shared=$folder/shared/$libdir
  mkdir -p "$shared/cmake/terrace" "$shared/pkgconfig"
  cp -R "$installed/include" "$folder/shared/"
  cp "$folder"/shared-build/meson-private/terrace-*.pc "$shared/pkgconfig"
  cp "$folder"/shared-build/cmake/*.cmake "$shared/cmake/terrace"
  for library in stream cluster matching tri terrain; do
    case $library in
      terrain) siblings='-lterracestream -lterracecluster -lterracetri' ;;
      *) siblings= ;;
    esac
    name=$(sed -n "s/.*terrace_file_$library \"\(.*\)\".*/\1/p" "$shared/cmake/terrace/terrace-config.cmake")
    # shellcheck disable=SC2046,SC2086
    "$@" -shared -o "$shared/$name" -Wl,-soname,"$name" -Wl,--whole-archive "$installed/$libdir/libterrace$library.a" \
      -Wl,--no-whole-archive -L"$shared" $siblings $(flags --libs-only-l "terrace-$library" | tr ' ' '\n' | grep -v '^-lterrace')
    ln -s "$name" "$shared/libterrace$library.so"
  done
  with_cmake shared "$folder/shared"
fi
