"""Tables and figures of the papers, made anew and judged: reports/papers.html."""
