# fish completion for relign-bench, printed by `relign-bench completion fish`. It gets the completions at the
# cursor from the program itself (`relign-bench complete`).
function __relign_bench_complete
    set -l before (commandline -opc)
    set -l program $before[1]
    set -e before[1]
    set -l word (commandline -ct)
    for line in ($program complete -- $before "$word" 2>/dev/null)
        switch $line
            case ':files'
                __fish_complete_path "$word"
            case ':folders'
                __fish_complete_directories "$word"
            case '*'
                printf '%s\n' $line
        end
    end
end
complete -c relign-bench -f -a '(__relign_bench_complete)'
