"""Banned phrases: (regular expression, what to write instead). Matched without regard to case, in prose alone (prose.py)."""

BANNED = [
    # Personification: name the actor and what it does.
    (r"\b(is|are|was|were|be|been|being) told\b", "'observes', 'receives', 'is given'"),
    (r"\bknows? of\b", "'has access to', 'observes'"),
    (r"\b(tells?|says?) (which|what|how|whether|where|by|so)\b", "'prints', 'reports', 'states', 'shows'"),
    (r"\bfinds? out\b", "'determines', 'detects'"),
    (r"\b(goes|go|went) on\b", "'resumes', 'continues'"),
    (r"\bcomes? of\b", "'results from'"),
    (r"\bwhat came of\b", "name the result"),
    (r"\b(lies|lie) (in|on|at|beside|behind|below|above|between|outside|within|under|there|here)\b", "'is in', 'is below'"),
    (r"\b(stands|stand|stood) (in|at|on|beside|behind|before|above|below|there|here|where|first|last)\b", "'is in', 'appears in'"),
    # Riddles.
    (r"\b(nobody|whoever|whosoever)\b", "name the actor, or 'unknown', 'no method'"),
    (r"\b(is|are|was) no (result|failure|truth|image|number|integer|message|instance|benchmark|choice|size|text|file|path)\b",
     "'is not a ...', 'does not count'"),
    (r"\bmakes? of (it|this|that|them|nothing)\b", "say what happens"),
    (r"\bhow surely\b", "'with confidence intervals'"),
    (r"\bwith a (word|sentence)\b", "'with a message'"),
    (r"\bwhole numbers?\b", "'integer'"),
    (r"\bheld against\b|\bholds? \w+ against\b", "'compared with', 'checked against'"),
    (r"\b(a|one) (row|line|value|number|column|entry|definition) an? (step|trial|method|scene|file|verb|instance|level)\b", "'per'"),
    (r"\bonce an? (trial|step|scene|run|file)\b", "'per'"),
    # Terms of the field.
    (r"\bconversations?\b", "'trial'"),
    (r"\b(learns?|learnt|learned|learning) beforehand\b|\bprepared beforehand\b", "'pretraining', 'pretrained'"),
    (r"\bglues? at\b", "'recommended pose', 'final pose'"),
    (r"\b(without|no|tells? no) truth\b", "'ground truth'"),
    (r"\bhopeless (lens|lenses|instances?)\b", "'infeasible instance'"),
    (r"\bbeware\b", "'caveat'"),
    (r"\brubbish\b", "'malformed message'"),
    (r"\bclear radi(us|i)\b", "'semi-diameter'"),
    (r"\b(hollow|bulging) (face|faces|surface|side)\b", "'concave', 'convex'"),
    (r"\bdice\b", "'Russian roulette'"),
    (r"\bveil\b", "'stray light'"),
    (r"\bparts? of (a|the) plan\b", "'shard'"),
    # British spelling; identifiers and proper names keep theirs (code spans are not checked).
    (r"(?<!-)\b(optim|normal|initial|recogn|minim|maxim|summar|visual|regular|character)iz(e|es|ed|ing|ation|ations)\b", "-ise, -isation"),
    (r"\b(colors?|behaviors?|neighbors?|centers?|centered)\b", "colour, behaviour, neighbour, centre"),
]
