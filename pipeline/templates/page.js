// Tables and methods copied as spreadsheets and papers take them; everything open in print.
"use strict";
(() => {
  const plain = (text) => text.replace(/\u2212/g, "-").replace(/\s+/g, " ").trim();

  // A cell over several rows or columns stands in its first column, in each of its rows.
  function rows(table) {
    const held = [];
    return [...table.rows].map((row) => {
      const out = [];
      const fill = () => {
        while (held[out.length]?.left > 0) {
          held[out.length].left -= 1;
          out.push(held[out.length].text);
        }
      };
      for (const cell of row.cells) {
        fill();
        const text = plain(cell.textContent);
        held[out.length] = { text, left: cell.rowSpan - 1 };
        out.push(text);
        for (let k = 1; k < cell.colSpan; k++) out.push("");
      }
      fill();
      return out.join("\t");
    });
  }

  async function copied(text) {
    try {
      await navigator.clipboard.writeText(text);
      return true;
    } catch {
      // pages from disk may not reach the clipboard that way
      const area = document.createElement("textarea");
      area.value = text;
      document.body.append(area);
      area.select();
      const done = document.execCommand("copy");
      area.remove();
      return done;
    }
  }

  function addButton(place, what, read) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", className: "copy", textContent: "copy" });
    button.setAttribute("aria-label", `Copy ${what}`);
    button.addEventListener("click", async () => {
      button.textContent = (await copied(read())) ? "copied" : "not allowed";
      setTimeout(() => { button.textContent = "copy"; }, 1500);
    });
    place.append(button);
  }

  for (const table of document.querySelectorAll("main table")) {
    const place = table.caption || table.createCaption();
    addButton(place, "this table", () => rows(table).join("\n"));
  }
  for (const part of document.querySelectorAll("[data-copy]")) {
    const bar = document.createElement("div");
    part.before(bar);
    addButton(bar, part.dataset.copy, () => part.innerText.trim());
  }

  const shut = [];
  addEventListener("beforeprint", () => {
    for (const part of document.querySelectorAll("details:not([open])")) {
      shut.push(part);
      part.open = true;
    }
  });
  addEventListener("afterprint", () => { for (const part of shut.splice(0)) part.open = false; });
})();
