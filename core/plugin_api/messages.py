"""Messages about services to and from processes, as C++ that the build includes."""

from description import MADE

# What the C++ side of a process needs for an argument: how the host reads it and passes it on, how the process sends it.
MESSAGES = {
    "text": ("const std::string {n} = in.text(\"{n}\")", "view({n})", "to_json({n})"),
    "object": ("const std::string {n} = in.object(\"{n}\")", "view({n})", "object_of({n}_json)"),
    "integer": ("const auto {n} = in.integer<std::uint64_t>(\"{n}\")", "{n}", "{n}"),
    "count": ("const auto {n} = in.integer<std::uint32_t>(\"{n}\")", "{n}", "{n}"),
    "numbers": ("const std::vector<double> {n} = in.numbers(\"{n}\")", "{n}.data(), count_of({n})", "to_json({n}, axes)"),
    "regions": ("const std::vector<std::uint32_t> {n} = in.regions(\"{n}\")", "{n}.data(), count_of({n}) / 4",
                "regions_of({n}, count)"),
    "counts": ("const std::vector<std::uint32_t> {n} = in.counts(\"{n}\")", "{n}.data(), count_of({n})",
               "to_json({n}, count)"),
    "lens": ("relign_model_lens* const {n} = in.lens(\"{n}\")", "{n}", "number_of({n})"),
    "bytes": ("const relign_text {n} = in.bytes(\"{n}\")", "{n}", "{n}.size"),
}
# And for a result: the host's variable, how it is passed, its JSON; how the process takes the JSON.
ANSWERS = {
    "json": ("TextSink {n}", "{n}.sink()", "parsed_json({n}.text())", "write({n}, {a}.dump())"),
    "number": ("double {n} = 0", "&{n}", "{n}", "*{n} = number_or_nan({a})"),
    "numbers": ("std::vector<double> {n}(in.axes())", "{n}.data(), count_of({n})", "{n}", "remote.take({a}, {n}, axes)"),
    "table": ("{rows} {n} = empty<{rows}>()", "&{n}", "to_json({n})", "take(remote.columns, {a}, *{n})"),
    "pixels": ("float* const {n} = in.pixels(table.image_width, table.image_height)", "{n}", "in.place_of_pixels()",
               "remote.take({a}, {n}, std::uint64_t{{remote.tables.{s}.image_width}} * remote.tables.{s}.image_height)"),
    "slopes": ("float* const {n} = in.pixels(table.image_width, table.image_height, in.axes() + 1 + 5 * elements.size())",
               "{n}", "in.place_of_pixels()",
               "remote.take({a}, {n}, std::uint64_t{{remote.tables.{s}.image_width}} * remote.tables.{s}.image_height * "
               "(axes + 1 + 5 * std::uint64_t{{count}}))"),
    "lens": ("relign_model_lens* {n} = nullptr", "&{n}", "in.keep({n})", "*{n} = lens_of({a})"),
    "bytes": ("TextSink {n}", "{n}.sink()", "in.give({n}.text())", "write({n}, remote.bytes({a}))"),
}


def tables_text(services):
    """One table of each service; what the host, its guard and the far side of a process share."""
    members = "".join(f"  {service.struct} {service.name}{{}};\n" for service in services)
    text = f"// {MADE}.\nstruct ServiceTables {{\n{members}}};\n\n"
    text += ("// Calls `fill` with the table of a service, which returns whether the service is offered. Null: it is not.\n"
             "template <class Fill>\nconst void* find_service(ServiceTables& tables, std::string_view id, Fill&& fill) {\n")
    for service in services:
        text += f"  if (id == {service.macro}) return fill(tables.{service.name}) ? &tables.{service.name} : nullptr;\n"
    text += "  return nullptr;\n}\n\n// Calls `visit` with each function of a table, as a pointer to the member.\n"
    for service in services:
        calls = "".join(f"  visit(Member<&{service.struct}::{function.name}>());\n" for function in service.functions)
        visit = "Visit&& visit" if calls else "Visit&&"
        text += f"template <class Visit>\nvoid for_each_function(const {service.struct}&, {visit}) {{\n{calls}}}\n"
    return text


def host_function(function):
    names = list(function.arguments.items())
    text = '  if (in.call() == "room") return in.room();\n' if "bytes" in function.arguments.values() else ""
    text += f'  if (in.call() == "{function.name}") {{\n'
    text += "".join(f"    {MESSAGES[kind][0].format(n=name)};\n" for name, kind in names)
    passed, members = ["table.context"] + [MESSAGES[kind][1].format(n=name) for name, kind in names], ""
    if function.kind:
        variable, pointer, json, _ = (function.fill(part, function.result) for part in ANSWERS[function.kind])
        text += f"    {variable};\n"
        passed.append(pointer)
        members = f'{{"{function.result}", {json}}}'
    text += f"    const relign_status status = table.{function.name}({', '.join(passed)});\n"
    text += f'    if (status == RELIGN_OK) in.forget({function.frees});\n' if function.frees else ""
    return text + f"    return status == RELIGN_OK ? result({{{members}}}) : in.failure(status);\n  }}\n"


def host_text(services):
    """The host's side: a request becomes a call of a table, what it wrote becomes the answer."""
    text = f"// {MADE}.\n"
    text += "".join(f"Json to_json(const {f.rows}& rows) {{\n  Json list = Json::array();\n"
                    "  for (std::uint32_t i = 0; i < rows.count; ++i)\n    list.push_back({" +
                    ", ".join(f'{{"{name}", {"to_string(" if column["kind"] == "text" else ""}rows.{name}[i]'
                              f'{")" if column["kind"] == "text" else ""}}}' for name, column in f.columns.items()) +
                    "});\n  return list;\n}\n\n"
                    for service in services for f in service.functions if f.kind == "table" and service.messages)
    text += "".join(f"Json answer(ProcessServices& in, const {service.struct}& table);\n" for service in services)
    for service in (service for service in services if service.messages):
        members = ", ".join(f'{{"{name}", ' + (f"parsed_json(to_string(table.{name}_json))" if member["kind"] == "json" else
                                               f"table.{name}") + "}" for name, member in service.members.items())
        text += f"\nJson answer(ProcessServices& in, const {service.struct}& table) {{\n"
        text += f'  if (in.call() == "open") return result({{{members}}});\n'
        text += "".join(map(host_function, service.functions)) + "  return in.unknown_call();\n}\n"
    text += ("\n// The word under \"observes\" for want of which a service is not offered; empty: it is for another reason.\n"
             "std::string missing_word(std::string_view id, std::uint32_t observes) {\n")
    text += "".join(f"  if (id == {service.macro} && !(observes & RELIGN_OBSERVES_{service.needs.upper()})) "
                    f'return "{service.needs}";\n' for service in services if service.needs)
    text += '  return "";\n}\n'
    text += "\nJson dispatch(ProcessServices& in, std::string_view id, const void* table) {\n"
    text += "".join(f"  if (id == {service.macro}) return answer(in, *static_cast<const {service.struct}*>(table));\n"
                    for service in services)
    return text + "  return in.unknown_call();\n}\n"


def remote_function(service, function):
    parameters = ", ".join(["void* context"] + function.parameters()).replace("uint32_t", "std::uint32_t").replace(
        "uint64_t", "std::uint64_t")
    members = ", ".join(f'{{"{name}", {MESSAGES[kind][2].format(n=name)}}}' for name, kind in function.arguments.items())
    text = f"  table.{function.name} = []({parameters}) -> relign_status {{\n"
    if function.kind:
        text += f"    if (!{function.result}) return RELIGN_BAD_ARGUMENT;\n"
    text += "    RemoteServices& remote = RemoteServices::self(context);\n"
    text += "    if (!remote.has_axes(axes)) return RELIGN_BAD_ARGUMENT;\n" if function.kind == "numbers" else ""
    for name in (name for name, kind in function.arguments.items() if kind == "bytes"):
        text += f"    if (const relign_status status = remote.put({name}); status != RELIGN_OK) return status;\n"
    text += f'    const Json answer = remote.ask({service.macro}, "{function.name}", {{{members}}});\n'
    if function.kind:
        take = function.fill(ANSWERS[function.kind][3], function.result)
        text += f"    if (status_of(answer) == RELIGN_OK) {take};\n"
    return text + "    return status_of(answer);\n  };\n"


def remote_text(services):
    """The side of a library in a process of its own: a call of a table becomes a request."""
    text = f"// {MADE}.\n"
    for function in (f for service in services for f in service.functions if f.kind == "table"):
        text += f"void take(Columns& columns, const Json& list, {function.rows}& rows) {{\n  columns.clear();\n"
        text += "  rows.count = static_cast<std::uint32_t>(list.size());\n"
        text += "".join(f'  rows.{name} = columns.{column["kind"]}s(list, "{name}");\n'
                        for name, column in function.columns.items()) + "}\n\n"
    for service in (service for service in services if service.messages):
        text += f"bool open(RemoteServices& services, {service.struct}& table) {{\n"
        text += f'  const Json members = services.ask({service.macro}, "open", {{}});\n'
        text += "  if (status_of(members) != RELIGN_OK) return false;\n"
        for name, member in service.members.items():
            text += {"json": f'  table.{name}_json = services.keep("{name}", members.at("{name}").dump());\n',
                     "count": f'  table.{name} = members.at("{name}").get<std::uint32_t>();\n'}[member["kind"]]
        text += "".join(remote_function(service, function) for function in service.functions) + "  return true;\n}\n\n"
    return text


def files(services):
    return {"service_tables.inc": tables_text(services), "host_messages.inc": host_text(services),
            "remote_messages.inc": remote_text(services)}
