# fish completion for relign-bench, printed by `relign-bench completion fish`. It gets the completions at the
# cursor from the program itself (`relign-bench complete`).
function __relign_bench_complete
    set -l before (commandline -opc)
    set -l program (string replace -r -- '^~(?=/)' $HOME $before[1])
    set -e before[1]
    set -l word (commandline -ct)
    set -l plain (string unescape -- "$word"; or string replace -r '^["\']' '' -- "$word") # or: a quote is open
    for line in ($program complete -- $before "$plain" 2>/dev/null)
        switch $line
            case ':files'
                complete -C "'' $word" # fish's own files: of the word as typed, with its quotes
            case ':folders'
                complete -C "'' $word" | string match -r '.*/(?:\t.*)?$'
            case '*'
                printf '%s\n' $line
        end
    end
end
complete -c relign-bench -f -a '(__relign_bench_complete)'
