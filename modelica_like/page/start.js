/* Where the page begins. */
document.body.append(element("datalist", { id: "formulas" }));
listenToHand();
listenToShelf();
listenToText();
listenToRuns();
listenToFiles();
addEventListener("unhandledrejection", (event) => tell(event.reason));
document.body.classList.add("no-run");
if (PAGE.folded) fold("text", false);
if (PAGE.folded || innerWidth < 820) fold("shelf", false);
change("state", {}).then(() => { search(); setTimeout(watch, PERIOD); }, tell);
