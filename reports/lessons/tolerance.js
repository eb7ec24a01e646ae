for (const film of document.querySelectorAll(".film")) {
  const controls = [...film.querySelectorAll("[data-control]")];
  const chosen = (control) => control.type === "range" ? control.value : control.querySelector("input:checked").value;
  const show = () => {
    for (const control of controls) if (control.type === "range") {
      const text = JSON.parse(control.dataset.texts)[control.value];
      control.setAttribute("aria-valuetext", text);
      control.parentElement.querySelector("output").textContent = text;
    }
    const frame = film.querySelector(`template[data-frame="${controls.map(chosen).join("-")}"]`).content.cloneNode(true);
    for (const part of ["says", "drawing"]) film.querySelector("." + part).replaceChildren(...frame.querySelector("." + part).childNodes);
  };
  film.querySelector(".controls").hidden = false;
  film.addEventListener("input", show);
  show();
}
