# bash completion for relign-bench, printed by `relign-bench completion bash`. It gets the completions at the
# cursor from the program itself (`relign-bench complete`).
_relign_bench() {
  local word=${COMP_WORDS[COMP_CWORD]} line path
  [[ $word == = ]] && word= # readline splits --option=value into three words
  COMPREPLY=()
  while IFS= read -r line; do
    case $line in
      :files)
        compopt -o filenames 2>/dev/null
        while IFS= read -r path; do COMPREPLY+=("$path"); done < <(compgen -f -- "$word")
        ;;
      :folders)
        compopt -o filenames 2>/dev/null
        while IFS= read -r path; do COMPREPLY+=("$path"); done < <(compgen -d -- "$word")
        ;;
      *) COMPREPLY+=("${line%%$'\t'*}") ;;
    esac
  done < <("${COMP_WORDS[0]/#\~/$HOME}" complete -- "${COMP_WORDS[@]:1:COMP_CWORD-1}" "$word" 2>/dev/null)
}
complete -F _relign_bench relign-bench
