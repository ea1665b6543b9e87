#!/bin/bash
# Completions: every shell reads its file, and bash and fish offer what they should.
# usage: completions.sh FOLDER WORK_FOLDER
set -euo pipefail
folder=$1 work=$2
built_in=$(basename -s .toml -a "$(dirname "$0")"/../../host/fit/schedules/*.toml)

bash -n "$folder/qjulia.bash"
zsh -n "$folder/_qjulia"
fish --no-config --no-execute "$folder/qjulia.fish"

rm -rf "$work"
mkdir -p "$work/shapes"
cd "$work"
touch bunny.obj bunny.ply bunny.qjulia.json 'two words.obj' notes.txt list.toml

set +e  # as in the shell of a user
compopt() { :; }  # which works in completions alone
# shellcheck disable=SC1091
source "$folder/qjulia.bash"
failed=0
# expect NAME WANTED GOT
expect() {
  [[ $2 == "$3" ]] && return
  echo "$1: '$3' is offered, '$2' was expected"
  failed=1
}
# in_bash WANTED WORD...: what bash offers for the last word, sorted, with commas between.
in_bash() {
  local wanted=$1
  shift
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
  _qjulia
  expect "bash: $*" "$wanted" "$(printf '%s\n' "${COMPREPLY[@]}" | LC_ALL=C sort -u | paste -sd,)"
}
# in_fish WANTED LINE
in_fish() {
  expect "fish: $2" "$1" "$(HOME=$work fish --no-config -c "source '$folder/qjulia.fish'; complete -C '$2'" |
    cut -f1 | LC_ALL=C sort -u | paste -sd,)"
}

in_bash render qjulia ren
in_bash --help,--version qjulia --
in_bash --precision qjulia render --prec
in_bash --precision qjulia render bunny.obj --prec
in_bash double,single qjulia render bunny.obj --precision ''
in_bash single qjulia render --precision = s
in_bash double,single qjulia render --precision =
in_bash -x,-y,-z qjulia render --up -
in_bash 'bunny.obj,bunny.ply,shapes,two words.obj' qjulia fit ''
in_bash bunny.qjulia.json qjulia surface bu
in_bash bunny.obj,bunny.ply,bunny.qjulia.json qjulia render bu
in_bash bunny.obj,bunny.ply qjulia compare bunny.qjulia.json bu
in_bash bunny.obj,bunny.ply qjulia compare --box 0 0 0 1 1 1 bunny.qjulia.json bu
in_bash bunny.obj,bunny.ply qjulia fit --factors 100 -o x.json bu
in_bash bunny.qjulia.json qjulia fit -o bu
in_bash check,merge,run,status qjulia batch ''
in_bash list.toml,shapes qjulia batch run ''
in_bash measure qjulia profile mea
in_bash --sample-points qjulia profile tune --sam
in_bash --programs qjulia doctor --pro
in_bash --programs qjulia doctor check --pro
in_bash '' qjulia doctor --programs ''
in_bash compare qjulia help profile com
in_bash shapes qjulia batch status ''
in_bash "$(printf '%s\n' "$built_in" list.toml shapes | LC_ALL=C sort | paste -sd,)" qjulia fit --schedule ''
in_bash '' qjulia render --size ''
in_bash render qjulia help ren

in_fish render 'qjulia ren'
in_fish --precision 'qjulia render --prec'
in_fish double,single 'qjulia render --precision '
in_fish 'bunny.obj,bunny.ply,shapes/,two words.obj' 'qjulia fit '
in_fish bunny.qjulia.json 'qjulia surface bu'
in_fish bunny.qjulia.json 'qjulia fit -o bu'
in_fish check,merge,run,status 'qjulia batch '
in_fish shapes/ 'qjulia batch status '
in_fish list.toml,shapes/ 'qjulia batch run '
in_fish --sample-points 'qjulia profile tune --sam'
in_fish --programs 'qjulia doctor --pro'
in_fish compare 'qjulia help profile com'
in_fish render 'qjulia help ren'
((failed == 0)) && echo "every shell offers what it should"
