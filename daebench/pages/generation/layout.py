"""Statements of C on lines of their own."""


def laid_out(text: str) -> str:
    """Return functions of C with one statement a line, and blocks indented."""
    lines: list[str] = []
    depth, within, line = 0, 0, ""

    def end() -> None:
        nonlocal line
        if line.strip():
            label = line.rstrip().endswith(":;")
            lines.append("    " * (depth - label) + line.strip())
        line = ""

    for letter in text:
        if letter == "{" and not line.rstrip().endswith("=") and not within:
            line += " {" if line.strip() and not line.endswith(" ") else "{"
            end()
            depth += 1
        elif letter == "}" and not within:
            end()
            depth -= 1
            line = "}"
            end()
        else:
            line += letter
            within += (letter in "({") - (letter in ")}")
            if letter == ";" and not within:
                end()
    end()
    return "\n".join(lines).replace("}\nelse {", "} else {").replace("\nstatic void", "\n\nstatic void") + "\n"
