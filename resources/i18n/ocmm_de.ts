<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de_DE">
<context>
    <name></name>
    <message>
        <source>Id</source>
        <translation>Kennung</translation>
    </message>
    <message>
        <source>What tests call it, such as BAR-1</source>
        <translation>Name in Prüfungen, etwa STAB-1</translation>
    </message>
    <message>
        <source>Name</source>
        <translation>Name</translation>
    </message>
    <message>
        <source>Of the artefact</source>
        <translation>Des Prüfkörpers</translation>
    </message>
    <message>
        <source>Maker</source>
        <translation>Hersteller</translation>
    </message>
    <message>
        <source>May be empty</source>
        <translation>Darf leer bleiben</translation>
    </message>
    <message>
        <source>Serial no.</source>
        <translation>Serien-Nr.</translation>
    </message>
    <message>
        <source>As engraved</source>
        <translation>Wie eingraviert</translation>
    </message>
    <message>
        <source>Laboratory</source>
        <translation>Labor</translation>
    </message>
    <message>
        <source>That calibrated it</source>
        <translation>Das es kalibriert hat</translation>
    </message>
    <message>
        <source>Certificate</source>
        <translation>Zertifikat</translation>
    </message>
    <message>
        <source>Certificate no.</source>
        <translation>Kalibrierschein-Nr.</translation>
    </message>
    <message>
        <source>Of the laboratory</source>
        <translation>Des Labors</translation>
    </message>
    <message>
        <source>Due</source>
        <translation>Fällig</translation>
    </message>
    <message>
        <source>Holds until, like 2027-06-30: your own rule</source>
        <translation>Gültig bis, etwa 2027-06-30: nach eigener Regel</translation>
    </message>
    <message>
        <source>Sizes, mm</source>
        <translation>Maße, mm</translation>
    </message>
    <message>
        <source>At 20 °C: diameter; or nests of a bar from 0</source>
        <translation>Bei 20 °C: Durchmesser; beim Maßstab die Aufnahmen ab 0</translation>
    </message>
    <message>
        <source>U, mm</source>
        <translation>U, mm</translation>
    </message>
    <message>
        <source>k = 2</source>
        <translation>k = 2</translation>
    </message>
    <message>
        <source>U per length</source>
        <translation>U je Länge</translation>
    </message>
    <message>
        <source>Part that grows with length; or empty</source>
        <translation>Mit der Länge wachsender Anteil; oder leer</translation>
    </message>
    <message>
        <source>Form, mm</source>
        <translation>Form, mm</translation>
    </message>
    <message>
        <source>Certified form error; empty if within U</source>
        <translation>Zertifizierte Formabweichung; leer, wenn innerhalb U</translation>
    </message>
    <message>
        <source>Expansion, 1/K</source>
        <translation>Ausdehnung, 1/K</translation>
    </message>
    <message>
        <source>Such as 1.15e-5</source>
        <translation>Etwa 1.15e-5</translation>
    </message>
    <message>
        <source>its u, 1/K</source>
        <translation>davon u, 1/K</translation>
    </message>
    <message>
        <source>Standard uncertainty, such as 1e-6</source>
        <translation>Standardunsicherheit, etwa 1e-6</translation>
    </message>
    <message>
        <source>Held</source>
        <translation>Halterung</translation>
    </message>
    <message>
        <source>Where and how it is held; may be empty</source>
        <translation>Wo und wie gehalten; darf leer bleiben</translation>
    </message>
    <message>
        <source>Quantity</source>
        <translation>Größe</translation>
    </message>
    <message>
        <source>Of a DCC with several lengths: part of its name</source>
        <translation>Bei DCC mit mehreren Längen: Teil ihres Namens</translation>
    </message>
    <message>
        <source>Artefact</source>
        <translation>Prüfkörper</translation>
    </message>
    <message>
        <source>Kind</source>
        <translation>Art</translation>
    </message>
    <message>
        <source>What the artefact is</source>
        <translation>Was für ein Prüfkörper</translation>
    </message>
    <message>
        <source>New</source>
        <translation>Neu</translation>
    </message>
    <message>
        <source>Empty the fields</source>
        <translation>Felder leeren</translation>
    </message>
    <message>
        <source>Read DCC</source>
        <translation>DCC lesen</translation>
    </message>
    <message>
        <source>Fill in from a digital certificate</source>
        <translation>Aus digitalem Kalibrierschein ausfüllen</translation>
    </message>
    <message>
        <source>Store</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Add to the register</source>
        <translation>In das Verzeichnis aufnehmen</translation>
    </message>
    <message>
        <source>Renew</source>
        <translation>Erneuern</translation>
    </message>
    <message>
        <source>Fill in the selected one, for a new certificate</source>
        <translation>Ausgewähltes eintragen, für neuen Kalibrierschein</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Take the selected one out</source>
        <translation>Ausgewähltes herausnehmen</translation>
    </message>
    <message>
        <source>Stop</source>
        <translation>Anhalten</translation>
    </message>
    <message>
        <source>Stop reading</source>
        <translation>Lesen abbrechen</translation>
    </message>
    <message>
        <source>What tests call it</source>
        <translation>Name in Prüfungen</translation>
    </message>
    <message>
        <source>What it is</source>
        <translation>Was es ist</translation>
    </message>
    <message>
        <source>U, µm</source>
        <translation>U, µm</translation>
    </message>
    <message>
        <source>Number and laboratory</source>
        <translation>Nummer und Labor</translation>
    </message>
    <message>
        <source>Holds until</source>
        <translation>Gültig bis</translation>
    </message>
    <message>
        <source>Refused for</source>
        <translation>Abgelehnt für</translation>
    </message>
    <message>
        <source>Procedures that cannot use it; select it for the reason</source>
        <translation>Verfahren, die es nicht nutzen können; Grund nach Auswahl</translation>
    </message>
    <message>
        <source>Reading the certificate</source>
        <translation>Kalibrierschein wird gelesen</translation>
    </message>
    <message>
        <source>Artefacts</source>
        <translation>Prüfkörper</translation>
    </message>
    <message>
        <source>Register of artefacts</source>
        <translation>Verzeichnis der Prüfkörper</translation>
    </message>
    <message>
        <source>Why the selected artefact is refused</source>
        <translation>Warum der ausgewählte Prüfkörper abgelehnt ist</translation>
    </message>
    <message>
        <source>Read the certificate from the file</source>
        <translation>Kalibrierschein aus Datei lesen</translation>
    </message>
    <message>
        <source>File of the DCC</source>
        <translation>Datei des DCC</translation>
    </message>
    <message>
        <source>Read</source>
        <translation>Lesen</translation>
    </message>
    <message>
        <source>Remove the artefact</source>
        <translation>Prüfkörper entfernen</translation>
    </message>
    <message>
        <source>Stored: {id}, due {due}.</source>
        <translation>Gespeichert: {id}, fällig {due}.</translation>
    </message>
    <message>
        <source>Remove {id} from the register?</source>
        <translation>{id} aus dem Verzeichnis entfernen?</translation>
    </message>
    <message>
        <source>Reading the register</source>
        <translation>Das Register wird gelesen</translation>
    </message>
    <message>
        <source>nothing</source>
        <translation>nichts</translation>
    </message>
    <message>
        <source>no test</source>
        <translation>keine Prüfung</translation>
    </message>
    <message numerus="yes">
        <source>%n artefacts</source>
        <comment>1 artefact</comment>
        <translation>
            <numerusform>%n Prüfkörper</numerusform>
            <numerusform>%n Prüfkörper</numerusform>
        </translation>
    </message>
    <message>
        <source>{count} in the register. Nothing is overwritten.</source>
        <translation>{count} im Verzeichnis. Nichts wird überschrieben.</translation>
    </message>
    <message>
        <source>Removed: {id}. Its lines stay in the file.</source>
        <translation>Entfernt: {id}. Die Zeilen bleiben in der Datei.</translation>
    </message>
    <message>
        <source>Read. Give an id and a due date, then store (F8).</source>
        <translation>Gelesen. Kennung und Fälligkeit eingeben, dann speichern (F8).</translation>
    </message>
    <message>
        <source>Acceptance test</source>
        <translation>Annahmeprüfung</translation>
    </message>
    <message>
        <source>Verdict stored. P writes the certificate.</source>
        <translation>Urteil gespeichert. P schreibt das Zertifikat.</translation>
    </message>
    <message numerus="yes">
        <source>%n positions</source>
        <comment>1 position</comment>
        <translation>
            <numerusform>%n Position</numerusform>
            <numerusform>%n Positionen</numerusform>
        </translation>
    </message>
    <message>
        <source>Unfinished tests</source>
        <translation>Unfertige Prüfungen</translation>
    </message>
    <message>
        <source>Nothing was changed.</source>
        <translation>Nichts wurde geändert.</translation>
    </message>
    <message>
        <source>A standard test of the instrument against its limits, with a verdict.</source>
        <translation>Eine genormte Prüfung des Geräts gegen seine Grenzen, mit Urteil.</translation>
    </message>
    <message>
        <source>Preparing the test</source>
        <translation>Die Prüfung wird vorbereitet</translation>
    </message>
    <message>
        <source>Retest</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Retest
[N]</source>
        <translation>Wiederholen
[N]</translation>
    </message>
    <message>
        <source>Points taken</source>
        <translation>Gemessene Punkte</translation>
    </message>
    <message>
        <source>Last error against its limit</source>
        <translation>Letzte Abweichung und ihre Grenze</translation>
    </message>
    <message>
        <source>Why something is measured again</source>
        <translation>Warum nochmals gemessen wird</translation>
    </message>
    <message>
        <source>Position</source>
        <translation>Position</translation>
    </message>
    <message>
        <source>Room, °C</source>
        <translation>Raum, °C</translation>
    </message>
    <message>
        <source>Type it when it changes, then Return</source>
        <translation>Bei Änderung eingeben, dann Eingabetaste</translation>
    </message>
    <message>
        <source>all points taken</source>
        <translation>alle Punkte gemessen</translation>
    </message>
    <message>
        <source>Position {number} of {count}: {name}</source>
        <translation>Position {number} von {count}: {name}</translation>
    </message>
    <message>
        <source>No errors yet: they follow when a position is complete.</source>
        <translation>Noch keine Abweichungen: sie folgen mit jeder fertigen Position.</translation>
    </message>
    <message>
        <source>Procedure</source>
        <translation>Verfahren</translation>
    </message>
    <message>
        <source>Title of the procedure</source>
        <translation>Titel des Verfahrens</translation>
    </message>
    <message>
        <source>Standard</source>
        <translation>Norm</translation>
    </message>
    <message>
        <source>Standard and edition that it is modelled on</source>
        <translation>Norm und Ausgabe, nach der es aufgebaut ist</translation>
    </message>
    <message>
        <source>Needs</source>
        <translation>Braucht</translation>
    </message>
    <message>
        <source>Artefact that it needs</source>
        <translation>Benötigter Prüfkörper</translation>
    </message>
    <message>
        <source>Min</source>
        <translation>Min.</translation>
    </message>
    <message>
        <source>Minutes for a trained person</source>
        <translation>Minuten für Geübte</translation>
    </message>
    <message>
        <source>Done by</source>
        <translation>Durchgeführt von</translation>
    </message>
    <message>
        <source>Your name, for the record</source>
        <translation>Eigener Name, für die Aufzeichnung</translation>
    </message>
    <message>
        <source>Temperature of the room, as measured</source>
        <translation>Gemessene Raumtemperatur</translation>
    </message>
    <message>
        <source>Place</source>
        <translation>Ort</translation>
    </message>
    <message>
        <source>Customer</source>
        <translation>Kunde</translation>
    </message>
    <message>
        <source>Humidity, %</source>
        <translation>Feuchte, %</translation>
    </message>
    <message>
        <source>Where; may be empty</source>
        <translation>Wo; darf leer sein</translation>
    </message>
    <message>
        <source>For whom; may be empty</source>
        <translation>Für wen; darf leer sein</translation>
    </message>
    <message>
        <source>optional</source>
        <translation>optional</translation>
    </message>
    <message>
        <source>Pressure, hPa</source>
        <translation>Druck, hPa</translation>
    </message>
    <message>
        <source>as found</source>
        <translation>wie vorgefunden</translation>
    </message>
    <message>
        <source>after adjustment</source>
        <translation>nach Justierung</translation>
    </message>
    <message>
        <source>Procedures</source>
        <translation>Verfahren</translation>
    </message>
    <message>
        <source>Limits of the procedure</source>
        <translation>Grenzen des Verfahrens</translation>
    </message>
    <message>
        <source>About the artefact</source>
        <translation>Zum Prüfkörper</translation>
    </message>
    <message>
        <source>Condition</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>State of the machine</source>
        <translation>Zustand des Geräts</translation>
    </message>
    <message>
        <source>Why it cannot start</source>
        <translation>Warum nicht begonnen werden kann</translation>
    </message>
    <message>
        <source>Start  [Return]</source>
        <translation>Start  [Eingabe]</translation>
    </message>
    <message>
        <source>Start the test</source>
        <translation>Prüfung beginnen</translation>
    </message>
    <message>
        <source>Resume  [G]</source>
        <translation>Fortsetzen  [G]</translation>
    </message>
    <message>
        <source>Resume the selected test</source>
        <translation>Ausgewählte Prüfung fortsetzen</translation>
    </message>
    <message>
        <source>Leave  [Esc]</source>
        <translation>Verlassen  [Esc]</translation>
    </message>
    <message>
        <source>Back to Maintain</source>
        <translation>Zurück zur Wartung</translation>
    </message>
    <message>
        <source>Reading unfinished tests</source>
        <translation>Unfertige Prüfungen werden gelesen</translation>
    </message>
    <message numerus="yes">
        <source>{title}, {who}: {done} of %n points</source>
        <comment>{title}, {who}: {done} of 1 point</comment>
        <translation>
            <numerusform>{title}, {who}: {done} von %n Punkt</numerusform>
            <numerusform>{title}, {who}: {done} von %n Punkten</numerusform>
        </translation>
    </message>
    <message>
        <source>Reading the procedures</source>
        <translation>Verfahren werden gelesen</translation>
    </message>
    <message>
        <source>Reading the artefacts</source>
        <translation>Prüfkörper werden gelesen</translation>
    </message>
    <message>
        <source>{name}, {serial}, due {due}</source>
        <translation>{name}, {serial}, fällig {due}</translation>
    </message>
    <message>
        <source>No artefact in the register suits. Add one: F9 in Maintain.</source>
        <translation>Kein passender Prüfkörper im Verzeichnis. Einen anlegen: F9 in der Wartung.</translation>
    </message>
    <message>
        <source>U {um:.2f} µm (k = 2)</source>
        <translation>U {um:.2f} µm (k = 2)</translation>
    </message>
    <message>
        <source>Not finished</source>
        <translation>Nicht fertig</translation>
    </message>
    <message>
        <source>sphere</source>
        <translation>Kugel</translation>
    </message>
    <message>
        <source>bar</source>
        <translation>Maßstab</translation>
    </message>
    <message>
        <source>gauge block</source>
        <translation>Endmaß</translation>
    </message>
    <message>
        <source>part</source>
        <translation>Werkstück</translation>
    </message>
    <message>
        <source>plate</source>
        <translation>Platte</translation>
    </message>
    <message>
        <source>dumbbell</source>
        <translation>Kugelstab</translation>
    </message>
    <message>
        <source>cone</source>
        <translation>Kegel</translation>
    </message>
    <message>
        <source>{wording}; rule: {rule}; limits: {limits}</source>
        <translation>{wording}; Regel: {rule}; Grenzen: {limits}</translation>
    </message>
    <message>
        <source>Draw plan</source>
        <translation>Plan auslosen</translation>
    </message>
    <message>
        <source>Draw the order and blind codes, and store them</source>
        <translation>Reihenfolge und Blindcodes auslosen und speichern</translation>
    </message>
    <message>
        <source>Open plan</source>
        <translation>Plan öffnen</translation>
    </message>
    <message>
        <source>Open the plan of a study</source>
        <translation>Plan einer Studie öffnen</translation>
    </message>
    <message>
        <source>Jobs</source>
        <translation>Aufträge</translation>
    </message>
    <message>
        <source>Choose the folder of the jobs</source>
        <translation>Ordner der Aufträge wählen</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>Which measurement comes next</source>
        <translation>Welche Messung als nächste kommt</translation>
    </message>
    <message>
        <source>Analyse</source>
        <translation>Auswerten</translation>
    </message>
    <message>
        <source>Gauge R&amp;R of every characteristic</source>
        <translation>Gauge R&amp;R für jedes Merkmal</translation>
    </message>
    <message>
        <source>Type 1</source>
        <translation>Typ 1</translation>
    </message>
    <message>
        <source>Cg and Cgk of the selected characteristic</source>
        <translation>Cg und Cgk des ausgewählten Merkmals</translation>
    </message>
    <message>
        <source>Stop the analysis</source>
        <translation>Auswertung anhalten</translation>
    </message>
    <message>
        <source>Study</source>
        <translation>Studie</translation>
    </message>
    <message>
        <source>Name; also the batch of its jobs</source>
        <translation>Name; zugleich Serie ihrer Aufträge</translation>
    </message>
    <message>
        <source>STUDY-1</source>
        <translation>STUDIE-1</translation>
    </message>
    <message>
        <source>Parts</source>
        <translation>Werkstücke</translation>
    </message>
    <message>
        <source>How many</source>
        <translation>Wie viele</translation>
    </message>
    <message>
        <source>Operators</source>
        <translation>Bediener</translation>
    </message>
    <message>
        <source>Names, parted by commas</source>
        <translation>Namen, durch Komma getrennt</translation>
    </message>
    <message>
        <source>Trials</source>
        <translation>Durchgänge</translation>
    </message>
    <message>
        <source>Of each operator on each part</source>
        <translation>Je Bediener und Werkstück</translation>
    </message>
    <message>
        <source>Seed</source>
        <translation>Startwert</translation>
    </message>
    <message>
        <source>The order is drawn from it</source>
        <translation>Aus ihm wird die Reihenfolge ausgelost</translation>
    </message>
    <message>
        <source>Reference, mm</source>
        <translation>Referenz, mm</translation>
    </message>
    <message>
        <source>Certified value, for type 1</source>
        <translation>Zertifizierter Wert, für Typ 1</translation>
    </message>
    <message>
        <source>Characteristic</source>
        <translation>Merkmal</translation>
    </message>
    <message>
        <source>As in the inspection plan</source>
        <translation>Wie im Prüfplan</translation>
    </message>
    <message>
        <source>GRR, µm</source>
        <translation>GRR, µm</translation>
    </message>
    <message>
        <source>Standard deviation, with its 90 % interval</source>
        <translation>Standardabweichung mit 90-%-Intervall</translation>
    </message>
    <message>
        <source>% study</source>
        <translation>% Studie</translation>
    </message>
    <message>
        <source>GRR of the whole variation</source>
        <translation>Anteil der GRR an der Gesamtstreuung</translation>
    </message>
    <message>
        <source>% tol.</source>
        <translation>% Tol.</translation>
    </message>
    <message>
        <source>6 GRR of the tolerance</source>
        <translation>6 GRR, bezogen auf die Toleranz</translation>
    </message>
    <message>
        <source>ndc</source>
        <translation>ndc</translation>
    </message>
    <message>
        <source>Distinct categories</source>
        <translation>Unterscheidbare Klassen</translation>
    </message>
    <message>
        <source>Own U</source>
        <translation>Eigene U</translation>
    </message>
    <message>
        <source>Scatter found over the uncertainty that is stated</source>
        <translation>Gefundene Streuung zur angegebenen Unsicherheit</translation>
    </message>
    <message>
        <source>Verdict</source>
        <translation>Urteil</translation>
    </message>
    <message>
        <source>AIAG: 10 and 30 %, ndc 5</source>
        <translation>AIAG: 10 und 30 %, ndc 5</translation>
    </message>
    <message>
        <source>none</source>
        <translation>keine</translation>
    </message>
    <message>
        <source>Gauge study</source>
        <translation>Prüfmittelfähigkeit</translation>
    </message>
    <message>
        <source>Analysing the jobs</source>
        <translation>Aufträge werden ausgewertet</translation>
    </message>
    <message>
        <source>Store the plan in the file</source>
        <translation>Plan in Datei speichern</translation>
    </message>
    <message>
        <source>File of the plan</source>
        <translation>Datei des Plans</translation>
    </message>
    <message>
        <source>Open the plan</source>
        <translation>Plan öffnen</translation>
    </message>
    <message>
        <source>Open</source>
        <translation>Öffnen</translation>
    </message>
    <message>
        <source>Jobs of the study in</source>
        <translation>Aufträge der Studie in</translation>
    </message>
    <message>
        <source>Folder of the jobs</source>
        <translation>Ordner der Aufträge</translation>
    </message>
    <message>
        <source>Use</source>
        <translation>Nehmen</translation>
    </message>
    <message>
        <source>Progress of the study</source>
        <translation>Fortschritt der Studie</translation>
    </message>
    <message>
        <source>What is to be told of the study</source>
        <translation>Hinweise zur Studie</translation>
    </message>
    <message>
        <source>Characteristics</source>
        <translation>Merkmale</translation>
    </message>
    <message>
        <source>Components</source>
        <translation>Anteile</translation>
    </message>
    <message>
        <source>By operator</source>
        <translation>Nach Bediener</translation>
    </message>
    <message>
        <source>Draw a plan (F6) or open one (F7). The codes are the serial numbers of jobs.</source>
        <translation>Plan auslosen (F6) oder öffnen (F7). Die Codes sind die Seriennummern der Aufträge.</translation>
    </message>
    <message>
        <source>Plan stored in {path}.</source>
        <translation>Plan gespeichert in {path}.</translation>
    </message>
    <message>
        <source>Reading the jobs</source>
        <translation>Aufträge werden gelesen</translation>
    </message>
    <message>
        <source>Analysing</source>
        <translation>Wird ausgewertet</translation>
    </message>
    <message>
        <source>{name}: {parts} parts, {operators} operators, {trials} trials</source>
        <translation>{name}: {parts} Werkstücke, {operators} Bediener, {trials} Durchgänge</translation>
    </message>
    <message>
        <source>{simulated}{name}: least tolerance {width:.4f} mm</source>
        <translation>{simulated}{name}: kleinste Toleranz {width:.4f} mm</translation>
    </message>
    <message>
        <source>SIMULATED. </source>
        <translation>SIMULIERT. </translation>
    </message>
    <message>
        <source>CAPABLE</source>
        <translation>FÄHIG</translation>
    </message>
    <message>
        <source>NOT CAPABLE</source>
        <translation>NICHT FÄHIG</translation>
    </message>
    <message>
        <source>{done} of {count} measured.</source>
        <translation>{done} von {count} gemessen.</translation>
    </message>
    <message>
        <source>Complete: analyse it (F8).</source>
        <translation>Vollständig: auswerten (F8).</translation>
    </message>
    <message>
        <source>Next: operator {who}, part {part}; serial number {code}.</source>
        <translation>Nächste: Bediener {who}, Werkstück {part}; Seriennummer {code}.</translation>
    </message>
    <message numerus="yes">
        <source>%n files left out</source>
        <comment>1 file left out</comment>
        <translation>
            <numerusform>%n Datei ausgelassen</numerusform>
            <numerusform>%n Dateien ausgelassen</numerusform>
        </translation>
    </message>
    <message>
        <source>{simulated}{done} of {count} measured. {left}</source>
        <translation>{simulated}{done} von {count} gemessen. {left}</translation>
    </message>
    <message>
        <source>NO STUDY</source>
        <translation>KEINE STUDIE</translation>
    </message>
    <message>
        <source>No plan is open.</source>
        <translation>Kein Plan geöffnet.</translation>
    </message>
    <message>
        <source>Draw one (F6) or open it.</source>
        <translation>Plan auslosen (F6) oder öffnen.</translation>
    </message>
    <message>
        <source>Of the whole test</source>
        <translation>Der ganzen Prüfung</translation>
    </message>
    <message>
        <source>Ended</source>
        <translation>Beendet</translation>
    </message>
    <message>
        <source>Local time</source>
        <translation>Ortszeit</translation>
    </message>
    <message>
        <source>Who</source>
        <translation>Wer</translation>
    </message>
    <message>
        <source>As entered</source>
        <translation>Wie eingegeben</translation>
    </message>
    <message>
        <source>Worst</source>
        <translation>Schlechtester</translation>
    </message>
    <message>
        <source>The value that is nearest to its limit or farthest beyond</source>
        <translation>Der Wert, der seiner Grenze am nächsten oder am weitesten darüber liegt</translation>
    </message>
    <message>
        <source>Record</source>
        <translation>Protokoll</translation>
    </message>
    <message>
        <source>Number of the record</source>
        <translation>Nummer des Protokolls</translation>
    </message>
    <message>
        <source>About the tests</source>
        <translation>Zu den Prüfungen</translation>
    </message>
    <message>
        <source>Acceptance tests</source>
        <translation>Annahmeprüfungen</translation>
    </message>
    <message>
        <source>Reading the tests</source>
        <translation>Prüfungen werden gelesen</translation>
    </message>
    <message numerus="yes">
        <source>%n tests</source>
        <comment>1 test</comment>
        <translation>
            <numerusform>%n Prüfung</numerusform>
            <numerusform>%n Prüfungen</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n not finished: F7 resumes</source>
        <translation>
            <numerusform>%n unfertig: F7 setzt fort</numerusform>
            <numerusform>%n unfertig: F7 setzt fort</numerusform>
        </translation>
    </message>
    <message>
        <source>SIMULATED: virtual rig. {said}</source>
        <translation>SIMULIERT: virtuelle Kameras. {said}</translation>
    </message>
    <message>
        <source>{quantity} {error:+.1f} of {limit:.1f} µm</source>
        <translation>{quantity} {error:+.1f} von {limit:.1f} µm</translation>
    </message>
    <message>
        <source>Where to touch</source>
        <translation>Wo anzutasten ist</translation>
    </message>
    <message>
        <source>{title}: point {next} of {count}</source>
        <translation>{title}: Punkt {next} von {count}</translation>
    </message>
    <message>
        <source>What is tested</source>
        <translation>Was geprüft wird</translation>
    </message>
    <message>
        <source>Where</source>
        <translation>Wo</translation>
    </message>
    <message>
        <source>Position and length</source>
        <translation>Position und Länge</translation>
    </message>
    <message>
        <source>Error, µm</source>
        <translation>Abweichung, µm</translation>
    </message>
    <message>
        <source>Test value</source>
        <translation>Prüfwert</translation>
    </message>
    <message>
        <source>Of the test value, k = 2</source>
        <translation>Des Prüfwerts, k = 2</translation>
    </message>
    <message>
        <source>MPE, µm</source>
        <translation>MPE, µm</translation>
    </message>
    <message>
        <source>Limit</source>
        <translation>Grenze</translation>
    </message>
    <message>
        <source>By the decision rule</source>
        <translation>Nach der Entscheidungsregel</translation>
    </message>
    <message>
        <source>Source</source>
        <translation>Quelle</translation>
    </message>
    <message>
        <source>Meaning of the verdict</source>
        <translation>Bedeutung des Urteils</translation>
    </message>
    <message>
        <source>Every value</source>
        <translation>Alle Werte</translation>
    </message>
    <message>
        <source>Errors and limits</source>
        <translation>Abweichungen und Grenzen</translation>
    </message>
    <message>
        <source>Interim checks</source>
        <translation>Zwischenprüfungen</translation>
    </message>
    <message>
        <source>Certificate (PDF and DCC)  [P]</source>
        <translation>Zertifikat (PDF und DCC)  [P]</translation>
    </message>
    <message>
        <source>Write the certificate, PDF and DCC</source>
        <translation>Zertifikat schreiben, PDF und DCC</translation>
    </message>
    <message>
        <source>Record  [2]</source>
        <translation>Protokoll  [2]</translation>
    </message>
    <message>
        <source>Show every value of the record</source>
        <translation>Alle Werte des Protokolls zeigen</translation>
    </message>
    <message>
        <source> (repeated)</source>
        <translation> (wiederholt)</translation>
    </message>
    <message>
        <source>{error:+.1f} µm, U {u:.1f} µm (k = 2), limit {limit:.1f} µm</source>
        <translation>{error:+.1f} µm, U {u:.1f} µm (k = 2), Grenze {limit:.1f} µm</translation>
    </message>
    <message>
        <source>Last: {errors}
{name}</source>
        <translation>Zuletzt: {errors}
{name}</translation>
    </message>
    <message>
        <source>Values</source>
        <translation>Werte</translation>
    </message>
    <message>
        <source>Retests left</source>
        <translation>Verbleibende Wiederholungen</translation>
    </message>
    <message>
        <source>Method</source>
        <translation>Methode</translation>
    </message>
    <message>
        <source>Rule</source>
        <translation>Regel</translation>
    </message>
    <message>
        <source>SIMULATED: virtual rig and artefact</source>
        <translation>SIMULIERT: virtuelle Kameras, virtueller Prüfkörper</translation>
    </message>
    <message>
        <source>NO VERDICT</source>
        <translation>KEIN URTEIL</translation>
    </message>
    <message>
        <source>NOT CALCULATED</source>
        <translation>NICHT BERECHNET</translation>
    </message>
    <message>
        <source>Press R to calculate.</source>
        <translation>R drücken, um zu berechnen.</translation>
    </message>
    <message>
        <source>OCMM

Starting: {source}</source>
        <translation>OCMM

Startet: {source}</translation>
    </message>
    <message>
        <source>worst {worst_us:.0f}</source>
        <translation>größte {worst_us:.0f}</translation>
    </message>
    <message>
        <source>no values</source>
        <translation>keine Werte</translation>
    </message>
    <message>
        <source>{least:.1f} to {most:.1f} µm</source>
        <translation>{least:.1f} bis {most:.1f} µm</translation>
    </message>
    <message>
        <source>{least:.1f} to {most:.1f} µm; hatched: not seen</source>
        <translation>{least:.1f} bis {most:.1f} µm; schraffiert: nicht gesehen</translation>
    </message>
    <message>
        <source>nothing seen</source>
        <translation>nichts gesehen</translation>
    </message>
    <message>
        <source>across: {across}   up: {up}</source>
        <translation>quer: {across}   hoch: {up}</translation>
    </message>
    <message>
        <source>Bending</source>
        <translation>Biegung</translation>
    </message>
    <message>
        <source>design not known</source>
        <translation>Konstruktion unbekannt</translation>
    </message>
    <message>
        <source>marks: LEDs; dashed: hand</source>
        <translation>Punkte: LEDs; gestrichelt: Hand</translation>
    </message>
    <message>
        <source>sag, held level / nm</source>
        <translation>Durchhang, waagerecht / nm</translation>
    </message>
    <message>
        <source>1 N on the ball / nm</source>
        <translation>1 N auf die Kugel / nm</translation>
    </message>
    <message>
        <source>Errors, µm</source>
        <translation>Abweichungen, µm</translation>
    </message>
    <message>
        <source>largest: {error} ({name})</source>
        <translation>größte: {error} ({name})</translation>
    </message>
    <message>
        <source>U {u:.1f} µm (k = 2), </source>
        <translation>U {u:.1f} µm (k = 2), </translation>
    </message>
    <message>
        <source>{error}, {u}limit {limit}</source>
        <translation>{error}, {u}Grenze {limit}</translation>
    </message>
    <message>
        <source>Interim checks, error in µm</source>
        <translation>Zwischenprüfungen, Abweichung in µm</translation>
    </message>
    <message>
        <source>no checks yet</source>
        <translation>noch keine Prüfungen</translation>
    </message>
    <message numerus="yes">
        <source>%n checks, last {error:+.1f} µm: {word}</source>
        <comment>1 check, last {error:+.1f} µm: {word}</comment>
        <translation>
            <numerusform>%n Prüfung, letzte {error:+.1f} µm: {word}</numerusform>
            <numerusform>%n Prüfungen, letzte {error:+.1f} µm: {word}</numerusform>
        </translation>
    </message>
    <message>
        <source>limit</source>
        <translation>Grenze</translation>
    </message>
    <message>
        <source>centre</source>
        <translation>Mitte</translation>
    </message>
    <message>
        <source>+3 s</source>
        <translation>+3 s</translation>
    </message>
    <message>
        <source>-3 s</source>
        <translation>-3 s</translation>
    </message>
    <message>
        <source>Tip of every frame, µm</source>
        <translation>Tastspitze je Bild, µm</translation>
    </message>
    <message>
        <source>RMS {axes}; {left_out} left out</source>
        <translation>RMS {axes}; {left_out} ausgelassen</translation>
    </message>
    <message>
        <source>frames of both sweeps</source>
        <translation>Bilder beider Schwenks</translation>
    </message>
    <message>
        <source>Residuals of the spots</source>
        <translation>Restabweichungen der Lichtpunkte</translation>
    </message>
    <message>
        <source>Camera {name}</source>
        <translation>Kamera {name}</translation>
    </message>
    <message>
        <source>arrows: means</source>
        <translation>Pfeile: Mittelwerte</translation>
    </message>
    <message numerus="yes">
        <source>%n spots, {left_out} left out</source>
        <comment>1 spot, {left_out} left out</comment>
        <translation>
            <numerusform>%n Lichtpunkt, {left_out} ausgelassen</numerusform>
            <numerusform>%n Lichtpunkte, {left_out} ausgelassen</numerusform>
        </translation>
    </message>
    <message>
        <source>Residuals on the sensors</source>
        <translation>Restabweichungen auf den Sensoren</translation>
    </message>
    <message>
        <source>Residuals, px</source>
        <translation>Restabweichungen, px</translation>
    </message>
    <message>
        <source>RMS {sigma:.4f} px, {beyond} of {count} beyond 3 sigma ({expected:.0f} expected)</source>
        <translation>RMS {sigma:.4f} px, {beyond} von {count} über 3 Sigma ({expected:.0f} erwartet)</translation>
    </message>
    <message>
        <source>RMS {axes} µm, largest {worst:.1f} µm</source>
        <translation>RMS {axes} µm, größte {worst:.1f} µm</translation>
    </message>
    <message>
        <source>from the front</source>
        <translation>von vorn</translation>
    </message>
    <message>
        <source>from above</source>
        <translation>von oben</translation>
    </message>
    <message numerus="yes">
        <source>{count} of %n directions</source>
        <comment>{count} of 1 direction</comment>
        <translation>
            <numerusform>{count} von %n Richtung</numerusform>
            <numerusform>{count} von %n Richtungen</numerusform>
        </translation>
    </message>
    <message>
        <source>▼ cameras</source>
        <translation>▼ Kameras</translation>
    </message>
    <message>
        <source>nothing yet</source>
        <translation>noch nichts</translation>
    </message>
    <message>
        <source>Components, % of study</source>
        <translation>Anteile, % der Studie</translation>
    </message>
    <message>
        <source>no study</source>
        <translation>keine Studie</translation>
    </message>
    <message>
        <source>GRR</source>
        <translation>GRR</translation>
    </message>
    <message>
        <source>Repeatability (EV)</source>
        <translation>Wiederholbarkeit (EV)</translation>
    </message>
    <message>
        <source>Operators (AV)</source>
        <translation>Bediener (AV)</translation>
    </message>
    <message>
        <source>Parts (PV)</source>
        <translation>Werkstücke (PV)</translation>
    </message>
    <message>
        <source>, {p:.1f} % of tolerance</source>
        <translation>, {p:.1f} % der Toleranz</translation>
    </message>
    <message>
        <source>GRR {p:.1f} % of study{tolerance}, ndc {ndc}: {word}</source>
        <translation>GRR {p:.1f} % der Studie{tolerance}, ndc {ndc}: {word}</translation>
    </message>
    <message>
        <source>Value less part mean, µm</source>
        <translation>Wert minus Werkstückmittel, µm</translation>
    </message>
    <message>
        <source>largest difference of operators {um:.1f} µm</source>
        <translation>größter Unterschied der Bediener {um:.1f} µm</translation>
    </message>
    <message>
        <source>Deviation, µm</source>
        <translation>Abweichung, µm</translation>
    </message>
    <message>
        <source>N {n}, Cg {cg:.2f} ({low:.2f} to {high:.2f}), Cgk {cgk:.2f}: {word}</source>
        <translation>N {n}, Cg {cg:.2f} ({low:.2f} bis {high:.2f}), Cgk {cgk:.2f}: {word}</translation>
    </message>
    <message>
        <source>Tolerance bar</source>
        <translation>Toleranzbalken</translation>
    </message>
    <message>
        <source>no tolerance</source>
        <translation>keine Toleranz</translation>
    </message>
    <message>
        <source>{name}: deviation {deviation}, limits {lower} to {upper}, {verdict}</source>
        <translation>{name}: Abweichung {deviation}, Grenzen {lower} bis {upper}, {verdict}</translation>
    </message>
    <message>
        <source>Paths of the LEDs about the ball</source>
        <translation>Bahnen der LEDs um die Kugel</translation>
    </message>
    <message numerus="yes">
        <source>%n poses, {leds} LEDs; drag to rotate</source>
        <comment>1 pose, {leds} LEDs; drag to rotate</comment>
        <translation>
            <numerusform>%n Lage, {leds} LEDs; mit der Maus drehen</numerusform>
            <numerusform>%n Lagen, {leds} LEDs; mit der Maus drehen</numerusform>
        </translation>
    </message>
    <message>
        <source>Trend over the parts</source>
        <translation>Verlauf über die Werkstücke</translation>
    </message>
    <message>
        <source>mean</source>
        <translation>Mittel</translation>
    </message>
    <message>
        <source>UCL</source>
        <translation>OEG</translation>
    </message>
    <message>
        <source>LCL</source>
        <translation>UEG</translation>
    </message>
    <message>
        <source>{name}: no parts included</source>
        <translation>{name}: keine Werkstücke einbezogen</translation>
    </message>
    <message numerus="yes">
        <source>{name}: %n parts, {least} to {most}, {signals}</source>
        <comment>{name}: 1 part, {least} to {most}, {signals}</comment>
        <translation>
            <numerusform>{name}: %n Teil, {least} bis {most}, {signals}</numerusform>
            <numerusform>{name}: %n Teile, {least} bis {most}, {signals}</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n signals</source>
        <comment>1 signal</comment>
        <translation>
            <numerusform>%n Signal</numerusform>
            <numerusform>%n Signale</numerusform>
        </translation>
    </message>
    <message>
        <source>Files</source>
        <translation>Dateien</translation>
    </message>
    <message>
        <source>Path</source>
        <translation>Pfad</translation>
    </message>
    <message>
        <source>Path of the file; Return opens it</source>
        <translation>Pfad der Datei; die Eingabetaste öffnet sie</translation>
    </message>
    <message>
        <source>Recent places</source>
        <translation>Zuletzt benutzt</translation>
    </message>
    <message>
        <source>Files of the folder</source>
        <translation>Dateien des Ordners</translation>
    </message>
    <message>
        <source>About the folder</source>
        <translation>Zum Ordner</translation>
    </message>
    <message>
        <source>Choose this folder</source>
        <translation>Diesen Ordner wählen</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Reading {folder}</source>
        <translation>{folder} wird gelesen</translation>
    </message>
    <message>
        <source>↑ Folder above</source>
        <translation>↑ Ordner darüber</translation>
    </message>
    <message numerus="yes">
        <source>%n files.</source>
        <comment>1 file.</comment>
        <translation>
            <numerusform>%n Datei.</numerusform>
            <numerusform>%n Dateien.</numerusform>
        </translation>
    </message>
    <message>
        <source>The first {count} are shown; type the path of others.</source>
        <translation>Die ersten {count} werden gezeigt; Pfad der anderen eingeben.</translation>
    </message>
    <message>
        <source>{path}: not there, or not what is looked for.</source>
        <translation>{path}: nicht vorhanden oder nicht das Gesuchte.</translation>
    </message>
    <message>
        <source>Find an action</source>
        <translation>Befehl suchen</translation>
    </message>
    <message>
        <source>What do you want to do?</source>
        <translation>Was ist zu tun?</translation>
    </message>
    <message>
        <source>What do you want to do? Return does it, Esc closes.</source>
        <translation>Was ist zu tun? Eingabe führt aus, Esc schließt.</translation>
    </message>
    <message>
        <source>Actions that fit</source>
        <translation>Passende Befehle</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Actions and their keys</source>
        <translation>Befehle und ihre Tasten</translation>
    </message>
    <message>
        <source>About the chosen key</source>
        <translation>Zur ausgewählten Taste</translation>
    </message>
    <message>
        <source>Choose an action and press Change; a foot switch is set up likewise.</source>
        <translation>Befehl wählen und „Ändern“ drücken; ein Fußschalter wird ebenso eingerichtet.</translation>
    </message>
    <message>
        <source>Change</source>
        <translation>Ändern</translation>
    </message>
    <message>
        <source>Default key</source>
        <translation>Standardtaste</translation>
    </message>
    <message>
        <source>{key} leaves and walks through pages.</source>
        <translation>{key} verlässt und blättert Seiten.</translation>
    </message>
    <message>
        <source>{key} is already {action}. Choose another key, or change that one first.</source>
        <translation>{key} ist schon {action}. Andere Taste wählen oder jene zuerst ändern.</translation>
    </message>
    <message>
        <source>{action} is now on {key}.</source>
        <translation>{action} liegt jetzt auf {key}.</translation>
    </message>
    <message>
        <source>The default key is now {action}. Change that one first.</source>
        <translation>Die Standardtaste ist jetzt {action}. Jene zuerst ändern.</translation>
    </message>
    <message>
        <source>Press the new key of {action}. Esc keeps the old one.</source>
        <translation>Neue Taste für {action} drücken. Esc behält die alte.</translation>
    </message>
    <message>
        <source>The key was not changed.</source>
        <translation>Die Taste wurde nicht geändert.</translation>
    </message>
    <message>
        <source>Press the new key</source>
        <translation>Neue Taste drücken</translation>
    </message>
    <message>
        <source>Waiting for a key</source>
        <translation>Wartet auf eine Taste</translation>
    </message>
    <message>
        <source>Other file</source>
        <translation>Andere Datei</translation>
    </message>
    <message>
        <source>Look for another plan file</source>
        <translation>Andere Plandatei suchen</translation>
    </message>
    <message>
        <source>Next</source>
        <translation>Weiter</translation>
    </message>
    <message>
        <source>Go on with this plan: who measures which part</source>
        <translation>Weiter mit diesem Plan: wer misst welches Werkstück</translation>
    </message>
    <message>
        <source>New job: choose the plan</source>
        <translation>Neuer Auftrag: Plan wählen</translation>
    </message>
    <message>
        <source>Plans</source>
        <translation>Prüfpläne</translation>
    </message>
    <message>
        <source>Reading the plans</source>
        <translation>Pläne werden gelesen</translation>
    </message>
    <message>
        <source>shipped with OCMM</source>
        <translation>mit OCMM geliefert</translation>
    </message>
    <message>
        <source>{name}, part {part}; {release}
{where}</source>
        <translation>{name}, Teil {part}; {release}
{where}</translation>
    </message>
    <message>
        <source>Return or F8 goes on with the selected plan.</source>
        <translation>Eingabe oder F8 geht mit dem ausgewählten Plan weiter.</translation>
    </message>
    <message>
        <source>About {setting}</source>
        <translation>Zu {setting}</translation>
    </message>
    <message>
        <source>Look for the file of {setting}</source>
        <translation>Datei suchen: {setting}</translation>
    </message>
    <message>
        <source>Set {setting} to its default</source>
        <translation>{setting} auf den Standard setzen</translation>
    </message>
    <message>
        <source>Yes</source>
        <translation>Ja</translation>
    </message>
    <message>
        <source>No</source>
        <translation>Nein</translation>
    </message>
    <message>
        <source>Differs from the default</source>
        <translation>Weicht vom Standard ab</translation>
    </message>
    <message>
        <source>Given at the start, which wins until OCMM is closed.</source>
        <translation>Beim Start angegeben; gilt, bis OCMM geschlossen wird.</translation>
    </message>
    <message>
        <source>Default: {default}.</source>
        <translation>Standard: {default}.</translation>
    </message>
    <message>
        <source>Set for this station.</source>
        <translation>Für diese Station festgelegt.</translation>
    </message>
    <message>
        <source>Set for this user only.</source>
        <translation>Nur für diesen Benutzer festgelegt.</translation>
    </message>
    <message>
        <source>Used when the job is opened.</source>
        <translation>Gilt, sobald der Auftrag geöffnet wird.</translation>
    </message>
    <message>
        <source>Return takes it.</source>
        <translation>Eingabe übernimmt.</translation>
    </message>
    <message>
        <source>as shipped</source>
        <translation>wie geliefert</translation>
    </message>
    <message>
        <source>empty</source>
        <translation>leer</translation>
    </message>
    <message>
        <source>Use now</source>
        <translation>Jetzt nutzen</translation>
    </message>
    <message>
        <source>Open the job again with these settings; no point is lost</source>
        <translation>Auftrag mit diesen Einstellungen neu öffnen; kein Punkt geht verloren</translation>
    </message>
    <message>
        <source>Write the support bundle to a file</source>
        <translation>Supportpaket in eine Datei schreiben</translation>
    </message>
    <message>
        <source>Mask names</source>
        <translation>Namen verdecken</translation>
    </message>
    <message>
        <source>Take names of people out, or keep them</source>
        <translation>Namen von Personen herausnehmen oder lassen</translation>
    </message>
    <message>
        <source>Leave out</source>
        <translation>Weglassen</translation>
    </message>
    <message>
        <source>Leave the selected part out, or not</source>
        <translation>Den gewählten Teil weglassen oder nicht</translation>
    </message>
    <message>
        <source>Gather again</source>
        <translation>Neu sammeln</translation>
    </message>
    <message>
        <source>Look again at everything</source>
        <translation>Alles neu zusammenstellen</translation>
    </message>
    <message>
        <source>Settings</source>
        <translation>Einstellungen</translation>
    </message>
    <message>
        <source>Support bundle</source>
        <translation>Supportpaket</translation>
    </message>
    <message>
        <source>Mask names of people</source>
        <translation>Namen von Personen verdecken</translation>
    </message>
    <message>
        <source>Files of the support bundle</source>
        <translation>Dateien des Supportpakets</translation>
    </message>
    <message>
        <source>What is in the selected file</source>
        <translation>Inhalt der gewählten Datei</translation>
    </message>
    <message>
        <source>Write the support bundle to</source>
        <translation>Supportpaket schreiben nach</translation>
    </message>
    <message>
        <source>File of the support bundle</source>
        <translation>Datei des Supportpakets</translation>
    </message>
    <message>
        <source>Gathering. Nothing is sent.</source>
        <translation>Wird gesammelt. Nichts wird gesendet.</translation>
    </message>
    <message>
        <source>Failed; nothing was written.</source>
        <translation>Fehlgeschlagen; nichts wurde geschrieben.</translation>
    </message>
    <message>
        <source>{name}  {size} KiB</source>
        <translation>{name}  {size} KiB</translation>
    </message>
    <message numerus="yes">
        <source>%n files, {size} KiB. This is all that is packed; nothing is sent. Passwords and keys are never in it.</source>
        <comment>1 file, {size} KiB. This is all that is packed; nothing is sent. Passwords and keys are never in it.</comment>
        <translation>
            <numerusform>%n Datei, {size} KiB. Nur das wird gepackt; nichts wird gesendet. Passwörter und Schlüssel sind nie dabei.</numerusform>
            <numerusform>%n Dateien, {size} KiB. Nur das wird gepackt; nichts wird gesendet. Passwörter und Schlüssel sind nie dabei.</numerusform>
        </translation>
    </message>
    <message>
        <source>Support bundle written to {path} ({size} KiB). Nothing was sent.</source>
        <translation>Supportpaket nach {path} geschrieben ({size} KiB). Nichts wurde gesendet.</translation>
    </message>
    <message>
        <source>What was not used</source>
        <translation>Was nicht genutzt wurde</translation>
    </message>
    <message>
        <source>Test of sounds</source>
        <translation>Töne anhören</translation>
    </message>
    <message>
        <source>Used from the next opening of the job: {names}. F8 opens it again now.</source>
        <translation>Gilt ab dem nächsten Öffnen des Auftrags: {names}. F8 öffnet ihn jetzt neu.</translation>
    </message>
    <message numerus="yes">
        <source>%n settings differ from the default (●).</source>
        <comment>1 setting differs from the default (●).</comment>
        <translation>
            <numerusform>%n Einstellung weicht vom Standard ab (●).</numerusform>
            <numerusform>%n Einstellungen weichen vom Standard ab (●).</numerusform>
        </translation>
    </message>
    <message>
        <source>New job</source>
        <translation>Neuer Auftrag</translation>
    </message>
    <message>
        <source>Choose a plan and measure a part</source>
        <translation>Plan wählen und ein Werkstück messen</translation>
    </message>
    <message>
        <source>Continue</source>
        <translation>Fortsetzen</translation>
    </message>
    <message>
        <source>Go on with the selected job</source>
        <translation>Ausgewählten Auftrag fortsetzen</translation>
    </message>
    <message>
        <source>Look at a job, or measure by a plan file</source>
        <translation>Auftrag ansehen oder nach einer Plandatei messen</translation>
    </message>
    <message>
        <source>Create or edit a plan</source>
        <translation>Prüfplan anlegen oder ändern</translation>
    </message>
    <message>
        <source>Expose by LEDs</source>
        <translation>Nach LEDs belichten</translation>
    </message>
    <message>
        <source>The brightest LED fills 70 % of a pixel; all cameras get one time and gain</source>
        <translation>Die hellste LED füllt ein Pixel zu 70 %; alle Kameras erhalten eine Zeit und Verstärkung</translation>
    </message>
    <message>
        <source>Darker</source>
        <translation>Dunkler</translation>
    </message>
    <message>
        <source>Shorter exposure by a fifth</source>
        <translation>Belichtung um ein Fünftel kürzer</translation>
    </message>
    <message>
        <source>Brighter</source>
        <translation>Heller</translation>
    </message>
    <message>
        <source>Longer exposure by a quarter</source>
        <translation>Belichtung um ein Viertel länger</translation>
    </message>
    <message>
        <source>Store the settings in the cameras, loaded at power-up</source>
        <translation>Einstellungen in den Kameras speichern; beim Einschalten geladen</translation>
    </message>
    <message>
        <source>Take view</source>
        <translation>Ansicht aufnehmen</translation>
    </message>
    <message>
        <source>Hold the board still: one picture of each camera</source>
        <translation>Die Tafel ruhig halten: ein Bild jeder Kamera</translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation>Kalibrieren</translation>
    </message>
    <message>
        <source>By all views in the folder</source>
        <translation>Mit allen Ansichten des Ordners</translation>
    </message>
    <message>
        <source>Put the calibration in force; it must be verified</source>
        <translation>Die Kalibrierung in Kraft setzen; sie muss verifiziert werden</translation>
    </message>
    <message>
        <source>Stop the calculation</source>
        <translation>Die Rechnung beenden</translation>
    </message>
    <message>
        <source>Black image</source>
        <translation>Dunkelbild</translation>
    </message>
    <message>
        <source>LEDs off, lenses covered: dark signal and hot pixels of each camera</source>
        <translation>LEDs aus, Objektive abgedeckt: Dunkelsignal und heiße Pixel jeder Kamera</translation>
    </message>
    <message>
        <source>Board</source>
        <translation>Tafel</translation>
    </message>
    <message>
        <source>Document of the calibration board</source>
        <translation>Dokument der Kalibriertafel</translation>
    </message>
    <message>
        <source>Views</source>
        <translation>Ansichten</translation>
    </message>
    <message>
        <source>Folder of the pictures; continued if it has some</source>
        <translation>Ordner der Bilder; vorhandene werden fortgesetzt</translation>
    </message>
    <message>
        <source>For the record</source>
        <translation>Für das Protokoll</translation>
    </message>
    <message>
        <source>The cameras load these settings at power-up.</source>
        <translation>Die Kameras laden diese Einstellungen beim Einschalten.</translation>
    </message>
    <message>
        <source>no image</source>
        <translation>kein Bild</translation>
    </message>
    <message>
        <source>Next view</source>
        <translation>Nächste Ansicht</translation>
    </message>
    <message>
        <source>Take views of a board to calibrate the cameras.</source>
        <translation>Zum Kalibrieren Ansichten einer Tafel aufnehmen.</translation>
    </message>
    <message>
        <source>Opening the cameras</source>
        <translation>Kameras werden geöffnet</translation>
    </message>
    <message>
        <source>Picture of camera {name}</source>
        <translation>Bild der Kamera {name}</translation>
    </message>
    <message>
        <source>Brightest LED of camera {name}</source>
        <translation>Hellste LED der Kamera {name}</translation>
    </message>
    <message>
        <source>Live; wave the probe through the volume, then press F2.</source>
        <translation>Live; den Taster durch das Volumen bewegen, dann F2 drücken.</translation>
    </message>
    <message>
        <source>Hold the board still</source>
        <translation>Die Tafel ruhig halten</translation>
    </message>
    <message>
        <source>View {number}: {corners} corners. {wanted}</source>
        <translation>Ansicht {number}: {corners} Ecken. {wanted}</translation>
    </message>
    <message>
        <source>View {number} is stored.</source>
        <translation>Ansicht {number} ist gespeichert.</translation>
    </message>
    <message>
        <source>The black images are stored.</source>
        <translation>Die Dunkelbilder sind gespeichert.</translation>
    </message>
    <message>
        <source>In force, and SUSPECT until it is verified: Calibrate (M), Verification.</source>
        <translation>In Kraft und FRAGLICH bis zur Verifikation: Kalibrieren (M), Verifikation.</translation>
    </message>
    <message>
        <source>Field &apos;{field}&apos; is empty: enter a path.</source>
        <translation>Feld „{field}“ ist leer: einen Pfad eingeben.</translation>
    </message>
    <message>
        <source>{serial}: exposure {exposure} µs, gain {gain}; spots: {spots}, {width} px wide; sharpness {focus} % of the best; incomplete images: {incomplete} of {images}; network card: {load}</source>
        <translation>{serial}: Belichtung {exposure} µs, Verstärkung {gain}; Lichtpunkte: {spots}, {width} px breit; Schärfe {focus} % der besten; unvollständige Bilder: {incomplete} von {images}; Netzwerkkarte: {load}</translation>
    </message>
    <message>
        <source>{views} views; residuals {rms:.3f} px RMS; corners scatter by {sigma:.3f} px.</source>
        <translation>{views} Ansichten; Restfehler {rms:.3f} px RMS; Ecken streuen um {sigma:.3f} px.</translation>
    </message>
    <message>
        <source>Accept (F8) puts it in force.</source>
        <translation>Annehmen (F8) setzt sie in Kraft.</translation>
    </message>
    <message>
        <source>Cameras, probe and tip: state and procedures</source>
        <translation>Kameras, Taster und Tastspitze: Zustand und Verfahren</translation>
    </message>
    <message>
        <source>What was measured where, when, by whom and with what; trends over stations</source>
        <translation>Was wo, wann, von wem und womit gemessen wurde; Trends über Stationen</translation>
    </message>
    <message>
        <source>Demo</source>
        <translation>Demo</translation>
    </message>
    <message>
        <source>SIMULATED: a robot hand measures a virtual part; take over and try</source>
        <translation>SIMULIERT: Eine Roboterhand misst ein virtuelles Werkstück; übernehmen und ausprobieren</translation>
    </message>
    <message>
        <source>Cameras, probe, folders, temperatures, language, units, sounds, keys</source>
        <translation>Kameras, Taster, Ordner, Temperaturen, Sprache, Einheiten, Töne, Tasten</translation>
    </message>
    <message>
        <source>Manual</source>
        <translation>Handbuch</translation>
    </message>
    <message>
        <source>Read about this page, and search the manual</source>
        <translation>Zu dieser Seite nachlesen und im Handbuch suchen</translation>
    </message>
    <message>
        <source>GigE Vision cameras: live pictures, exposure, calibration by a board</source>
        <translation>GigE-Vision-Kameras: Livebilder, Belichtung, Kalibrierung mit einer Tafel</translation>
    </message>
    <message>
        <source>Theme</source>
        <translation>Farbschema</translation>
    </message>
    <message>
        <source>Switch between dark, light and high contrast</source>
        <translation>Zwischen dunkel, hell und kontrastreich wechseln</translation>
    </message>
    <message>
        <source>Quit</source>
        <translation>Beenden</translation>
    </message>
    <message>
        <source>Close OCMM</source>
        <translation>OCMM schließen</translation>
    </message>
    <message>
        <source>Start page</source>
        <translation>Startseite</translation>
    </message>
    <message>
        <source>What to do first</source>
        <translation>Was zuerst zu tun ist</translation>
    </message>
    <message>
        <source>Reading the records of cameras and tip</source>
        <translation>Protokolle von Kameras und Tastspitze werden gelesen</translation>
    </message>
    <message>
        <source>First steps</source>
        <translation>Erste Schritte</translation>
    </message>
    <message>
        <source>1. Demo (F9): a robot hand measures a virtual part; take over and try.
2. Settings (Ctrl+,): choose cameras, probe and folders of this station.
3. Calibrate (M): cameras, then probe and tip, each with a guided procedure.
4. New job (F2): choose a plan and measure the first part.</source>
        <translation>1. Demo (F9): Eine Roboterhand misst ein virtuelles Werkstück; übernehmen und ausprobieren.
2. Einstellungen (Strg+,): Kameras, Taster und Ordner dieser Station wählen.
3. Kalibrieren (M): Kameras, dann Taster und Tastspitze, jeweils mit geführtem Ablauf.
4. Neuer Auftrag (F2): einen Plan wählen und das erste Werkstück messen.</translation>
    </message>
    <message>
        <source>The measurements are SIMULATED. New here? Press Demo (F9) and touch a virtual part.</source>
        <translation>Die Messungen sind SIMULIERT. Neu hier? Demo (F9) drücken und ein virtuelles Werkstück antasten.</translation>
    </message>
    <message>
        <source>Last jobs</source>
        <translation>Letzte Aufträge</translation>
    </message>
    <message>
        <source>Up and down select a job; Return goes on with it</source>
        <translation>Auf und Ab wählen einen Auftrag; Eingabe setzt ihn fort</translation>
    </message>
    <message>
        <source>SIMULATED. {verdict}</source>
        <translation>SIMULIERT. {verdict}</translation>
    </message>
    <message>
        <source>{part}, serial {serial}
{verdict}
{when}, {operator}, {points}, {name}</source>
        <translation>{part}, Seriennr. {serial}
{verdict}
{when}, {operator}, {points}, {name}</translation>
    </message>
    <message>
        <source>{done}, verdict follows</source>
        <translation>{done}, Ergebnis folgt</translation>
    </message>
    <message>
        <source>paused, {done}</source>
        <translation>angehalten, {done}</translation>
    </message>
    <message>
        <source>About {what}</source>
        <translation>Zu {what}</translation>
    </message>
    <message>
        <source>Ready. New job begins with the plan; Continue goes on.</source>
        <translation>Bereit. „Neuer Auftrag“ beginnt mit dem Plan; „Fortsetzen“ geht weiter.</translation>
    </message>
    <message>
        <source>No points can be taken yet: Calibrate shows what is missing.</source>
        <translation>Noch keine Punkte möglich: „Kalibrieren“ zeigt, was fehlt.</translation>
    </message>
    <message>
        <source>No jobs in {folder} yet</source>
        <translation>Noch keine Aufträge in {folder}</translation>
    </message>
    <message numerus="yes">
        <source>{done} of %n features</source>
        <comment>{done} of 1 feature</comment>
        <translation>
            <numerusform>{done} von %n Element</numerusform>
            <numerusform>{done} von %n Elementen</numerusform>
        </translation>
    </message>
    <message>
        <source>probe</source>
        <translation>Taster</translation>
    </message>
    <message>
        <source>rig</source>
        <translation>Kamerasystem</translation>
    </message>
    <message>
        <source>plan</source>
        <translation>Plan</translation>
    </message>
    <message>
        <source>reference body</source>
        <translation>Referenzkörper</translation>
    </message>
    <message>
        <source>Ask</source>
        <translation>Abfragen</translation>
    </message>
    <message>
        <source>Ask the archive</source>
        <translation>Das Archiv abfragen</translation>
    </message>
    <message>
        <source>Next question</source>
        <translation>Nächste Frage</translation>
    </message>
    <message>
        <source>Choose the next question</source>
        <translation>Die nächste Frage wählen</translation>
    </message>
    <message>
        <source>Write the table to a file, .csv or .parquet</source>
        <translation>Die Tabelle in eine Datei schreiben, .csv oder .parquet</translation>
    </message>
    <message>
        <source>Stop; what is shown stays</source>
        <translation>Anhalten; was gezeigt wird, bleibt</translation>
    </message>
    <message>
        <source>Recall archived jobs, or back to the questions</source>
        <translation>Rückruf archivierter Aufträge, oder zurück zu den Fragen</translation>
    </message>
    <message>
        <source>Store the recall; stations hold back what does not hold</source>
        <translation>Rückruf speichern; Stationen halten zurück, was nicht gilt</translation>
    </message>
    <message>
        <source>What was measured</source>
        <translation>Was gemessen wurde</translation>
    </message>
    <message>
        <source>Trend of a characteristic</source>
        <translation>Trend eines Merkmals</translation>
    </message>
    <message>
        <source>Which jobs used this</source>
        <translation>Welche Aufträge dies benutzten</translation>
    </message>
    <message>
        <source>Cpk by month</source>
        <translation>Cpk nach Monat</translation>
    </message>
    <message>
        <source>Who passed what</source>
        <translation>Wer was freigegeben hat</translation>
    </message>
    <message>
        <source>R&amp;R over stations</source>
        <translation>R&amp;R über Stationen</translation>
    </message>
    <message>
        <source>name of the part</source>
        <translation>Name des Werkstücks</translation>
    </message>
    <message>
        <source>What</source>
        <translation>Was</translation>
    </message>
    <message>
        <source>hash, serial number or name</source>
        <translation>Hash, Seriennummer oder Name</translation>
    </message>
    <message>
        <source>empty: all</source>
        <translation>leer: alle</translation>
    </message>
    <message>
        <source>Station</source>
        <translation>Station</translation>
    </message>
    <message>
        <source>From</source>
        <translation>Von</translation>
    </message>
    <message>
        <source>day, e.g. 2026-11-26; empty: today</source>
        <translation>Tag, z. B. 2026-11-26; leer: heute</translation>
    </message>
    <message>
        <source>To</source>
        <translation>Bis</translation>
    </message>
    <message>
        <source>day; empty: the same</source>
        <translation>Tag; leer: derselbe</translation>
    </message>
    <message>
        <source>Archive</source>
        <translation>Archiv</translation>
    </message>
    <message>
        <source>Asking the archive</source>
        <translation>Archiv wird abgefragt</translation>
    </message>
    <message>
        <source>What is asked of the archive</source>
        <translation>Was das Archiv gefragt wird</translation>
    </message>
    <message>
        <source>What was used</source>
        <translation>Was benutzt wurde</translation>
    </message>
    <message>
        <source>Write the table to the file</source>
        <translation>Die Tabelle in die Datei schreiben</translation>
    </message>
    <message>
        <source>What must be known about the answer</source>
        <translation>Was man zur Antwort wissen muss</translation>
    </message>
    <message>
        <source>Hand-over to the archive</source>
        <translation>Übergabe an das Archiv</translation>
    </message>
    <message>
        <source>Checks the archived jobs. Nothing is changed.</source>
        <translation>Prüft die archivierten Aufträge. Nichts wird geändert.</translation>
    </message>
    <message>
        <source>Fill in what it is about, then ask (F8).</source>
        <translation>Angeben, worum es geht, dann abfragen (F8).</translation>
    </message>
    <message>
        <source>Recall first (F8): there are no pages yet.</source>
        <translation>Erst den Rückruf rechnen (F8): es gibt noch keine Seiten.</translation>
    </message>
    <message>
        <source>Ask first (F8): there is no table yet.</source>
        <translation>Erst abfragen (F8): noch gibt es keine Tabelle.</translation>
    </message>
    <message>
        <source>Choose what was found wrong, then recall (F8). Nothing is changed.</source>
        <translation>Wählen, was falsch war, dann Rückruf rechnen (F8). Nichts wird geändert.</translation>
    </message>
    <message>
        <source>Turn to the recall first (F10).</source>
        <translation>Erst zum Rückruf wechseln (F10).</translation>
    </message>
    <message>
        <source>Everything measured here is in the archive.</source>
        <translation>Alles hier Gemessene ist im Archiv.</translation>
    </message>
    <message>
        <source>Table written to {path}.</source>
        <translation>Tabelle nach {path} geschrieben.</translation>
    </message>
    <message>
        <source>The archive is off. Turn it on in Settings (Ctrl+,).</source>
        <translation>Das Archiv ist aus. In den Einstellungen (Strg+,) einschalten.</translation>
    </message>
    <message>
        <source>{text} is no day.</source>
        <translation>{text} ist kein Tag.</translation>
    </message>
    <message>
        <source>Write it like 2026-11-26.</source>
        <translation>So schreiben: 2026-11-26.</translation>
    </message>
    <message>
        <source>SIMULATED</source>
        <translation>SIMULIERT</translation>
    </message>
    <message>
        <source>{sentence} Due on {date}.</source>
        <translation>{sentence} Fällig am {date}.</translation>
    </message>
    <message>
        <source>{name}: cannot be read, {when}
{why}</source>
        <translation>{name}: nicht lesbar, {when}
{why}</translation>
    </message>
    <message>
        <source>no points yet</source>
        <translation>noch keine Punkte</translation>
    </message>
    <message>
        <source>Open a job to look at it, or a plan to measure by it</source>
        <translation>Auftrag zum Ansehen öffnen oder Plan zum Messen</translation>
    </message>
    <message>
        <source>Plan of the new job</source>
        <translation>Plan des neuen Auftrags</translation>
    </message>
    <message>
        <source>Inspect</source>
        <translation>Messen</translation>
    </message>
    <message>
        <source>Maintain</source>
        <translation>Wartung</translation>
    </message>
    <message>
        <source>Take</source>
        <translation>Aufnehmen</translation>
    </message>
    <message>
        <source>Take a point now</source>
        <translation>Jetzt einen Punkt aufnehmen</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Undo the last point</source>
        <translation>Letzten Punkt zurücknehmen</translation>
    </message>
    <message>
        <source>Finish</source>
        <translation>Abschließen</translation>
    </message>
    <message>
        <source>Finish this feature and go to the next</source>
        <translation>Dieses Element abschließen, weiter zum nächsten</translation>
    </message>
    <message>
        <source>Flip</source>
        <translation>Wenden</translation>
    </message>
    <message>
        <source>Flip the last point to the other side</source>
        <translation>Letzten Punkt auf die andere Seite wenden</translation>
    </message>
    <message>
        <source>Previous</source>
        <translation>Voriges</translation>
    </message>
    <message>
        <source>Show the previous feature of the plan</source>
        <translation>Voriges Element des Plans zeigen</translation>
    </message>
    <message>
        <source>Show the next feature of the plan</source>
        <translation>Nächstes Element des Plans zeigen</translation>
    </message>
    <message>
        <source>Skip</source>
        <translation>Auslassen</translation>
    </message>
    <message>
        <source>Skip this feature; it can be measured later</source>
        <translation>Dieses Element auslassen; es kann später gemessen werden</translation>
    </message>
    <message>
        <source>Repeat</source>
        <translation>Erneut</translation>
    </message>
    <message>
        <source>Repeat this feature; its old points stay in the file</source>
        <translation>Dieses Element neu messen; alte Punkte bleiben in der Datei</translation>
    </message>
    <message>
        <source>Reopen</source>
        <translation>Wieder öffnen</translation>
    </message>
    <message>
        <source>Reopen a finished or skipped feature to add points</source>
        <translation>Fertiges oder ausgelassenes Element für weitere Punkte öffnen</translation>
    </message>
    <message>
        <source>Order</source>
        <translation>Abfolge</translation>
    </message>
    <message>
        <source>Switch between plan order and any order</source>
        <translation>Zwischen Planreihenfolge und beliebiger wechseln</translation>
    </message>
    <message>
        <source>Side</source>
        <translation>Seite</translation>
    </message>
    <message>
        <source>Change how the probe side is found</source>
        <translation>Ändern, wie die Antastseite bestimmt wird</translation>
    </message>
    <message>
        <source>Pause</source>
        <translation>Pause</translation>
    </message>
    <message>
        <source>Pause or resume</source>
        <translation>Anhalten oder fortsetzen</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Redo the last undone step</source>
        <translation>Zurückgenommenen Schritt wiederherstellen</translation>
    </message>
    <message>
        <source>Next point</source>
        <translation>Nächster Punkt</translation>
    </message>
    <message>
        <source>Select the next point of the feature</source>
        <translation>Nächsten Punkt des Elements wählen</translation>
    </message>
    <message>
        <source>Previous point</source>
        <translation>Voriger Punkt</translation>
    </message>
    <message>
        <source>Select the previous point</source>
        <translation>Vorigen Punkt wählen</translation>
    </message>
    <message>
        <source>Delete point</source>
        <translation>Punkt löschen</translation>
    </message>
    <message>
        <source>Delete the selected point and give a reason</source>
        <translation>Ausgewählten Punkt mit Grund löschen</translation>
    </message>
    <message>
        <source>Restore</source>
        <translation>Zurückholen</translation>
    </message>
    <message>
        <source>Restore the deleted point</source>
        <translation>Gelöschten Punkt zurückholen</translation>
    </message>
    <message>
        <source>Tone</source>
        <translation>Ton</translation>
    </message>
    <message>
        <source>Turn the approach tone on or off</source>
        <translation>Annäherungston ein- oder ausschalten</translation>
    </message>
    <message>
        <source>Refit</source>
        <translation>Neu rechnen</translation>
    </message>
    <message>
        <source>Recalculate all results from the raw data</source>
        <translation>Alle Ergebnisse aus den Rohdaten neu berechnen</translation>
    </message>
    <message>
        <source>Job</source>
        <translation>Auftrag</translation>
    </message>
    <message>
        <source>Operator, serial number, next part, unfinished jobs</source>
        <translation>Bediener, Seriennummer, nächstes Werkstück, unfertige Aufträge</translation>
    </message>
    <message>
        <source>Results</source>
        <translation>Ergebnisse</translation>
    </message>
    <message>
        <source>All characteristics, their uncertainty, and reports to print, such as PDF</source>
        <translation>Alle Merkmale, ihre Unsicherheit, und Berichte zum Drucken, etwa als PDF</translation>
    </message>
    <message>
        <source>Plan</source>
        <translation>Prüfplan</translation>
    </message>
    <message>
        <source>Alignment</source>
        <translation>Ausrichtung</translation>
    </message>
    <message>
        <source>Alignment: residuals and free axes</source>
        <translation>Ausrichtung: Restabweichungen und freie Achsen</translation>
    </message>
    <message>
        <source>Serve program</source>
        <translation>Messprogramm</translation>
    </message>
    <message>
        <source>Show this job on a tablet or phone at the part</source>
        <translation>Diesen Auftrag auf einem Tablet oder Telefon am Werkstück zeigen</translation>
    </message>
    <message>
        <source>Far view</source>
        <translation>Fernansicht</translation>
    </message>
    <message>
        <source>Switch between far view and desk view</source>
        <translation>Zwischen Fernansicht und Nahansicht wechseln</translation>
    </message>
    <message>
        <source>Cameras</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>Show or hide the live camera images</source>
        <translation>Kamerabilder zeigen oder verbergen</translation>
    </message>
    <message>
        <source>Fit view</source>
        <translation>Alles zeigen</translation>
    </message>
    <message>
        <source>Zoom the 3-D view to the whole part</source>
        <translation>3-D-Ansicht auf das ganze Werkstück zoomen</translation>
    </message>
    <message>
        <source>Close-up</source>
        <translation>Nahaufnahme</translation>
    </message>
    <message>
        <source>Zoom the 3-D view to the active feature</source>
        <translation>3-D-Ansicht auf das aktive Element zoomen</translation>
    </message>
    <message>
        <source>Part look</source>
        <translation>Darstellung</translation>
    </message>
    <message>
        <source>Show the part shaded, as hidden lines or transparent</source>
        <translation>Werkstück schattiert, mit verdeckten Linien oder durchsichtig zeigen</translation>
    </message>
    <message>
        <source>Export</source>
        <translation>Export</translation>
    </message>
    <message>
        <source>Write the report files</source>
        <translation>Berichtsdateien schreiben</translation>
    </message>
    <message>
        <source>Bus report</source>
        <translation>Busbericht</translation>
    </message>
    <message>
        <source>Write the bus report as text, for support</source>
        <translation>Busbericht als Text schreiben, für den Support</translation>
    </message>
    <message>
        <source>Calibrate cameras</source>
        <translation>Kameras kalibrieren</translation>
    </message>
    <message>
        <source>Calibrate the cameras from known points</source>
        <translation>Kameras an bekannten Punkten kalibrieren</translation>
    </message>
    <message>
        <source>Relocate</source>
        <translation>Neu einmessen</translation>
    </message>
    <message>
        <source>Recalibrate the cameras in place, with the probe and a length bar</source>
        <translation>Kameras vor Ort neu kalibrieren, mit Taster und Längenmaßstab</translation>
    </message>
    <message>
        <source>Calibrate tracker</source>
        <translation>Tracker kalibrieren</translation>
    </message>
    <message>
        <source>Measure the noise of an optical tracker</source>
        <translation>Das Rauschen eines optischen Trackers messen</translation>
    </message>
    <message>
        <source>Verify</source>
        <translation>Verifizieren</translation>
    </message>
    <message>
        <source>Verify the calibration with independent artefacts</source>
        <translation>Kalibrierung mit unabhängigen Prüfkörpern verifizieren</translation>
    </message>
    <message>
        <source>Write to cameras</source>
        <translation>In Kameras schreiben</translation>
    </message>
    <message>
        <source>Store the intrinsics of the calibration in the cameras</source>
        <translation>Abbildungsparameter der Kalibrierung in den Kameras speichern</translation>
    </message>
    <message>
        <source>Recall jobs</source>
        <translation>Rückruf</translation>
    </message>
    <message>
        <source>Recalculate older jobs whose calibration later failed</source>
        <translation>Ältere Aufträge neu berechnen, deren Kalibrierung später ausfiel</translation>
    </message>
    <message>
        <source>Jobs of all stations: lists, trends, what used a calibration</source>
        <translation>Aufträge aller Stationen: Listen, Trends, was eine Kalibrierung benutzte</translation>
    </message>
    <message>
        <source>Calibrate probe</source>
        <translation>Taster kalibrieren</translation>
    </message>
    <message>
        <source>Find tip and LED positions: pivot the probe with its ball in a cone</source>
        <translation>Tastspitze und LEDs bestimmen: Taster mit der Kugel im Kegelsitz schwenken</translation>
    </message>
    <message>
        <source>Qualify tip</source>
        <translation>Spitze einmessen</translation>
    </message>
    <message>
        <source>Find the ball diameter on a certified sphere</source>
        <translation>Kugeldurchmesser an einer zertifizierten Kugel bestimmen</translation>
    </message>
    <message>
        <source>Check tip</source>
        <translation>Spitze prüfen</translation>
    </message>
    <message>
        <source>One-minute check that the tip is still as qualified</source>
        <translation>In einer Minute prüfen, ob die Tastspitze noch wie eingemessen ist</translation>
    </message>
    <message>
        <source>Mount tip</source>
        <translation>Spitze montieren</translation>
    </message>
    <message>
        <source>Confirm tip change</source>
        <translation>Wechsel der Tastspitze bestätigen</translation>
    </message>
    <message>
        <source>Define</source>
        <translation>Definieren</translation>
    </message>
    <message>
        <source>Define a new probe document</source>
        <translation>Neues Tasterdokument anlegen</translation>
    </message>
    <message>
        <source>Standard tests with limits and a verdict</source>
        <translation>Genormte Prüfungen mit Grenzen und Urteil</translation>
    </message>
    <message>
        <source>Interim check</source>
        <translation>Zwischenprüfung</translation>
    </message>
    <message>
        <source>90 seconds: is the system still as it was</source>
        <translation>90 Sekunden: ist das System noch wie zuvor</translation>
    </message>
    <message>
        <source>Register of spheres, bars, blocks and parts</source>
        <translation>Verzeichnis von Kugeln, Maßstäben, Endmaßen und Werkstücken</translation>
    </message>
    <message>
        <source>Measurement system analysis from jobs</source>
        <translation>Prüfmittelfähigkeit aus Aufträgen</translation>
    </message>
    <message>
        <source>Write the certificate of what this page shows, PDF and DCC</source>
        <translation>Zertifikat dieser Seite schreiben, PDF und DCC</translation>
    </message>
    <message>
        <source>SIMULATED: take the probe from the robot hand, or hand it back</source>
        <translation>SIMULIERT: den Taster von der Roboterhand übernehmen oder zurückgeben</translation>
    </message>
    <message>
        <source>Tour</source>
        <translation>Rundgang</translation>
    </message>
    <message>
        <source>SIMULATED: learn the window in two minutes</source>
        <translation>SIMULIERT: das Fenster in zwei Minuten kennenlernen</translation>
    </message>
    <message>
        <source>Symptoms, errors and their remedies, to be searched</source>
        <translation>Symptome, Fehler und ihre Abhilfe, durchsuchbar</translation>
    </message>
    <message>
        <source>Pack what support needs, after showing what is inside</source>
        <translation>Packen, was der Support braucht, nachdem der Inhalt gezeigt wurde</translation>
    </message>
    <message>
        <source>All keyboard shortcuts of the window</source>
        <translation>Alle Tasten des Fensters</translation>
    </message>
    <message>
        <source>Let a measuring program measure by I++ DME, in a separate job; or stop it</source>
        <translation>Ein Messprogramm über I++ DME messen lassen, in eigenem Auftrag; oder beenden</translation>
    </message>
    <message>
        <source>Home</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Leave the job for the Start page; no point is lost</source>
        <translation>Vom Auftrag zur Startseite; kein Punkt geht verloren</translation>
    </message>
    <message>
        <source>Find</source>
        <translation>Suchen</translation>
    </message>
    <message>
        <source>Type what you want to do</source>
        <translation>Eingeben, was zu tun ist</translation>
    </message>
    <message>
        <source>Larger</source>
        <translation>Größer</translation>
    </message>
    <message>
        <source>Show everything larger</source>
        <translation>Alles größer zeigen</translation>
    </message>
    <message>
        <source>Smaller</source>
        <translation>Kleiner</translation>
    </message>
    <message>
        <source>Show everything smaller</source>
        <translation>Alles kleiner zeigen</translation>
    </message>
    <message>
        <source>Usual size</source>
        <translation>Übliche Größe</translation>
    </message>
    <message>
        <source>Show everything as large as fits the screen</source>
        <translation>Alles so groß zeigen, wie es zum Bildschirm passt</translation>
    </message>
    <message>
        <source>Glove mode</source>
        <translation>Handschuhe</translation>
    </message>
    <message>
        <source>Make buttons and rows at least 15 mm, or as usual</source>
        <translation>Tasten und Zeilen mindestens 15 mm groß zeigen, oder wie üblich</translation>
    </message>
    <message>
        <source>Save log</source>
        <translation>Log speichern</translation>
    </message>
    <message>
        <source>Save the message log, for support</source>
        <translation>Meldungen speichern, für den Support</translation>
    </message>
    <message>
        <source>Switch between Inspect and Maintain</source>
        <translation>Zwischen Messen und Wartung wechseln</translation>
    </message>
    <message>
        <source>Return</source>
        <translation>Eingabe</translation>
    </message>
    <message>
        <source>Enter</source>
        <translation>Enter</translation>
    </message>
    <message>
        <source>Backspace</source>
        <translation>Rück</translation>
    </message>
    <message>
        <source>Ins</source>
        <translation>Einfg</translation>
    </message>
    <message>
        <source>Del</source>
        <translation>Entf</translation>
    </message>
    <message>
        <source>PgUp</source>
        <translation>Bild↑</translation>
    </message>
    <message>
        <source>PgDown</source>
        <translation>Bild↓</translation>
    </message>
    <message>
        <source>Shift</source>
        <translation>Umschalt</translation>
    </message>
    <message>
        <source>Ctrl</source>
        <translation>Strg</translation>
    </message>
    <message>
        <source>Alt</source>
        <translation>Alt</translation>
    </message>
    <message>
        <source>Question</source>
        <translation>Frage</translation>
    </message>
    <message>
        <source>{verb}  [Return]</source>
        <translation>{verb}  [Eingabe]</translation>
    </message>
    <message>
        <source>Back  [Esc]</source>
        <translation>Zurück  [Esc]</translation>
    </message>
    <message>
        <source>{verb} anyway</source>
        <translation>Trotzdem {verb}</translation>
    </message>
    <message>
        <source>Cancel and go back</source>
        <translation>Abbrechen und zurück</translation>
    </message>
    <message>
        <source>Part and cameras have moved {moved_mm:.1f} mm and {turned_rad:.2f}° relative to each other since the job started. Points follow the reference body &apos;{name}&apos;.</source>
        <translation>Werkstück und Kameras haben sich seit Beginn des Auftrags um {moved_mm:.1f} mm und {turned_rad:.2f}° gegeneinander bewegt. Die Punkte folgen dem Referenzkörper „{name}“.</translation>
    </message>
    <message numerus="yes">
        <source>%n outliers.</source>
        <comment>1 outlier.</comment>
        <translation>
            <numerusform>%n Ausreißer.</numerusform>
            <numerusform>%n Ausreißer.</numerusform>
        </translation>
    </message>
    <message>
        <source>Outliers: {named}. Still used in the fit. Delete to exclude.</source>
        <translation>Ausreißer: {named}. Zählen in der Einpassung noch mit. Zum Ausschließen löschen.</translation>
    </message>
    <message>
        <source>Selected: {point}. Del deletes it.</source>
        <translation>Ausgewählt: {point}. Entf löscht ihn.</translation>
    </message>
    <message>
        <source>Point {numbers} deleted. Ins restores it.</source>
        <translation>Punkt {numbers} gelöscht. Einfg holt ihn zurück.</translation>
    </message>
    <message>
        <source>Without point {numbers} rms falls {fold}-fold to {rms}. Remove it? Press Del.</source>
        <translation>Ohne Punkt {numbers} fällt die RMS um den Faktor {fold} auf {rms}. Entfernen? Entf drücken.</translation>
    </message>
    <message>
        <source>Without point {numbers} the others fit with rms {rms}. Remove it? Press Del.</source>
        <translation>Ohne Punkt {numbers} passen die anderen mit RMS {rms}. Entfernen? Entf drücken.</translation>
    </message>
    <message>
        <source>point {number}</source>
        <translation>Punkt {number}</translation>
    </message>
    <message>
        <source>point {number} ({residual})</source>
        <translation>Punkt {number} ({residual})</translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation>ANGEHALTEN</translation>
    </message>
    <message>
        <source>Open the job again: Start page, Continue.</source>
        <translation>Auftrag wieder öffnen: Startseite, Fortsetzen.</translation>
    </message>
    <message>
        <source>Paused. Press Z to resume.</source>
        <translation>Angehalten. Z drücken, um fortzusetzen.</translation>
    </message>
    <message>
        <source>{name} is done. Press F6 to reopen it, PgDown to go on.</source>
        <translation>{name} ist fertig. F6 öffnet es wieder, Bild↓ geht weiter.</translation>
    </message>
    <message>
        <source>{name} is skipped. Press F6 to reopen it, PgDown to go on.</source>
        <translation>{name} ist ausgelassen. F6 öffnet es wieder, Bild↓ geht weiter.</translation>
    </message>
    <message>
        <source>Select and measure what is missing, or press E to write the report.</source>
        <translation>Fehlendes wählen und messen, oder E drücken, um den Bericht zu schreiben.</translation>
    </message>
    <message>
        <source>All features measured. Press E to write the report.</source>
        <translation>Alle Elemente gemessen. E drücken, um den Bericht zu schreiben.</translation>
    </message>
    <message>
        <source>Touch any feature; it is identified by position.</source>
        <translation>Beliebiges Element antasten; es wird an der Lage erkannt.</translation>
    </message>
    <message>
        <source>Touch, or wait for the point that the program asks for.</source>
        <translation>Antasten, oder auf den Punkt warten, den das Programm verlangt.</translation>
    </message>
    <message>
        <source>Too fast: {speed:.0f} mm/s. Slide more slowly.</source>
        <translation>Zu schnell: {speed:.0f} mm/s. Langsamer gleiten.</translation>
    </message>
    <message>
        <source>{length:.0f} mm, {speed:.0f} mm/s. Release the button to finish.</source>
        <translation>{length:.0f} mm, {speed:.0f} mm/s. Zum Beenden die Taste loslassen.</translation>
    </message>
    <message>
        <source>{name} has all its points. Press Return to finish it.</source>
        <translation>{name} hat alle Punkte. Eingabe drücken, um es abzuschließen.</translation>
    </message>
    <message>
        <source>Press on {name}, hold the button and slide {way:.0f} mm.</source>
        <translation>Auf {name} drücken, Taste halten und {way:.0f} mm gleiten.</translation>
    </message>
    <message>
        <source>Press on {name}, hold the button and slide {way:.0f} mm around.</source>
        <translation>Auf {name} drücken, Taste halten und {way:.0f} mm ringsum gleiten.</translation>
    </message>
    <message>
        <source>Press on {name}, hold the button and slide {way:.0f} mm in a spiral.</source>
        <translation>Auf {name} drücken, Taste halten und {way:.0f} mm in einer Spirale gleiten.</translation>
    </message>
    <message>
        <source>Press on {name}, hold the button and slide {way:.0f} mm in parallel lines.</source>
        <translation>Auf {name} drücken, Taste halten und {way:.0f} mm in parallelen Linien gleiten.</translation>
    </message>
    <message>
        <source>Lost contact. Put the ball back on the surface.</source>
        <translation>Kontakt verloren. Kugel wieder auf die Fläche setzen.</translation>
    </message>
    <message>
        <source>{share:.0f} % of the scan, {speed:.0f} mm/s. Release the button to finish.</source>
        <translation>{share:.0f} % des Scans, {speed:.0f} mm/s. Zum Beenden Taste loslassen.</translation>
    </message>
    <message numerus="yes">
        <source>Next: touch %n points on {name}.</source>
        <comment>Next: touch one point on {name}.</comment>
        <translation>
            <numerusform>Nächstes: einen Punkt auf {name} antasten.</numerusform>
            <numerusform>Nächstes: %n Punkte auf {name} antasten.</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>Touch %n more points on {name}.</source>
        <comment>Touch one more point on {name}.</comment>
        <translation>
            <numerusform>Noch einen Punkt auf {name} antasten.</numerusform>
            <numerusform>Noch %n Punkte auf {name} antasten.</numerusform>
        </translation>
    </message>
    <message>
        <source>serial {serial}</source>
        <translation>Serien-Nr. {serial}</translation>
    </message>
    <message>
        <source>order {order}</source>
        <translation>Bestellung {order}</translation>
    </message>
    <message>
        <source>batch {batch}</source>
        <translation>Serie {batch}</translation>
    </message>
    <message>
        <source>Plan order</source>
        <translation>Planreihenfolge</translation>
    </message>
    <message>
        <source>Any order</source>
        <translation>Beliebige Reihenfolge</translation>
    </message>
    <message>
        <source>{order}. Side: {side}.</source>
        <translation>{order}. Seite: {side}.</translation>
    </message>
    <message>
        <source>{distance:.0f} mm to the next point</source>
        <translation>{distance:.0f} mm bis zum nächsten Punkt</translation>
    </message>
    <message>
        <source>about {distance:.0f} mm to the next point</source>
        <translation>etwa {distance:.0f} mm bis zum nächsten Punkt</translation>
    </message>
    <message>
        <source>approach direction</source>
        <translation>Antastrichtung</translation>
    </message>
    <message>
        <source>pull away after the touch</source>
        <translation>nach dem Antasten abheben</translation>
    </message>
    <message>
        <source>along the shank</source>
        <translation>entlang des Schafts</translation>
    </message>
    <message>
        <source>as the plan says</source>
        <translation>wie im Plan</translation>
    </message>
    <message>
        <source>No point: {what} {remedy}</source>
        <translation>Kein Punkt: {what} {remedy}</translation>
    </message>
    <message>
        <source>ACTIVE</source>
        <translation>AKTIV</translation>
    </message>
    <message>
        <source>OPEN</source>
        <translation>OFFEN</translation>
    </message>
    <message>
        <source>SKIPPED</source>
        <translation>AUSGELASSEN</translation>
    </message>
    <message>
        <source>DONE</source>
        <translation>FERTIG</translation>
    </message>
    <message>
        <source>NO TOLERANCE</source>
        <translation>KEINE TOLERANZ</translation>
    </message>
    <message>
        <source>No characteristics in the plan</source>
        <translation>Keine Merkmale im Plan</translation>
    </message>
    <message>
        <source>No messages.
</source>
        <translation>Keine Meldungen.
</translation>
    </message>
    <message>
        <source>Notice</source>
        <translation>Meldung</translation>
    </message>
    <message>
        <source>Notice text</source>
        <translation>Text der Meldung</translation>
    </message>
    <message>
        <source>Dismiss  [Esc]</source>
        <translation>Schließen  [Esc]</translation>
    </message>
    <message>
        <source>Dismiss</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>{word}  ({count} more)</source>
        <translation>{word}  ({count} weitere)</translation>
    </message>
    <message>
        <source>Dismiss this message</source>
        <translation>Diese Meldung schließen</translation>
    </message>
    <message>
        <source>Browse</source>
        <translation>Suchen</translation>
    </message>
    <message>
        <source>Look for the file or folder</source>
        <translation>Datei oder Ordner suchen</translation>
    </message>
    <message>
        <source>Close without changes</source>
        <translation>Ohne Änderung schließen</translation>
    </message>
    <message>
        <source>missed the surface</source>
        <translation>Fläche verfehlt</translation>
    </message>
    <message>
        <source>Delete a point</source>
        <translation>Punkt löschen</translation>
    </message>
    <message>
        <source>Reason for deletion</source>
        <translation>Grund des Löschens</translation>
    </message>
    <message>
        <source>Delete</source>
        <translation>Löschen</translation>
    </message>
    <message>
        <source>Delete the point now</source>
        <translation>Punkt jetzt löschen</translation>
    </message>
    <message>
        <source>Close without deleting</source>
        <translation>Schließen ohne zu löschen</translation>
    </message>
    <message>
        <source>Reason for deleting point {number}</source>
        <translation>Grund, Punkt {number} zu löschen</translation>
    </message>
    <message>
        <source>Back</source>
        <translation>Zurück</translation>
    </message>
    <message>
        <source>Back to measuring; nothing is lost</source>
        <translation>Zurück zum Messen; nichts geht verloren</translation>
    </message>
    <message>
        <source>About this page</source>
        <translation>Zu dieser Seite</translation>
    </message>
    <message>
        <source>{reached} of {count} reached</source>
        <translation>{reached} von {count} erreicht</translation>
    </message>
    <message>
        <source>no reason</source>
        <translation>kein Grund</translation>
    </message>
    <message>
        <source>Corners</source>
        <translation>Ecken</translation>
    </message>
    <message>
        <source>Repeats</source>
        <translation>Wiederholungen</translation>
    </message>
    <message>
        <source>Form</source>
        <translation>Form</translation>
    </message>
    <message>
        <source>{error_mm:.1f} µm, limit {limit_mm:.1f} µm</source>
        <translation>{error_mm:.1f} µm, Grenze {limit_mm:.1f} µm</translation>
    </message>
    <message>
        <source>{name}: progress</source>
        <translation>{name}: Fortschritt</translation>
    </message>
    <message>
        <source>Stopped; nothing was changed.</source>
        <translation>Angehalten; nichts wurde geändert.</translation>
    </message>
    <message>
        <source>F9 stops.</source>
        <translation>F9 hält an.</translation>
    </message>
    <message>
        <source>Failed; the previous result is still shown.</source>
        <translation>Fehlgeschlagen; das vorige Ergebnis steht noch da.</translation>
    </message>
    <message>
        <source>Frames</source>
        <translation>Bilder</translation>
    </message>
    <message>
        <source>frames taken from all cameras</source>
        <translation>Bilder von allen Kameras</translation>
    </message>
    <message>
        <source>Frames lost</source>
        <translation>Verlorene Bilder</translation>
    </message>
    <message>
        <source>frames lost: sent by a camera, not received</source>
        <translation>verlorene Bilder: von einer Kamera gesendet, nicht empfangen</translation>
    </message>
    <message>
        <source>Recoveries</source>
        <translation>Neuanläufe</translation>
    </message>
    <message>
        <source>number of recoveries to operation</source>
        <translation>wie oft der Bus wieder in Betrieb ging</translation>
    </message>
    <message>
        <source>Stray answers</source>
        <translation>Fremde Antworten</translation>
    </message>
    <message>
        <source>late, duplicate or out-of-order answers, discarded</source>
        <translation>verspätete, doppelte oder vertauschte Antworten, verworfen</translation>
    </message>
    <message>
        <source>Objects done</source>
        <translation>Objekte fertig</translation>
    </message>
    <message>
        <source>transfers of camera objects</source>
        <translation>Übertragungen von Kameraobjekten</translation>
    </message>
    <message>
        <source>Objects failed</source>
        <translation>Objekte fehlgeschlagen</translation>
    </message>
    <message>
        <source>transfers of camera objects that failed</source>
        <translation>fehlgeschlagene Übertragungen von Kameraobjekten</translation>
    </message>
    <message>
        <source>Cycle</source>
        <translation>Zyklus</translation>
    </message>
    <message>
        <source>time from one exchange to the next</source>
        <translation>Zeit von einem Austausch zum nächsten</translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation>Belichtung</translation>
    </message>
    <message>
        <source>time from one exposure to the next</source>
        <translation>Zeit von einer Belichtung zur nächsten</translation>
    </message>
    <message>
        <source>Bus</source>
        <translation>Bus</translation>
    </message>
    <message>
        <source>Phase of the bus</source>
        <translation>Phase des Busses</translation>
    </message>
    <message>
        <source>Bus fault</source>
        <translation>Busfehler</translation>
    </message>
    <message>
        <source>Cycle starts late, µs</source>
        <translation>Zyklusbeginn verspätet, µs</translation>
    </message>
    <message>
        <source>Round trip, µs</source>
        <translation>Umlauf, µs</translation>
    </message>
    <message>
        <source>Cycle to bus clock, µs</source>
        <translation>Zyklus zur Busuhr, µs</translation>
    </message>
    <message>
        <source>Drift, ppm</source>
        <translation>Drift, ppm</translation>
    </message>
    <message>
        <source>Clocks, ns</source>
        <translation>Uhren, ns</translation>
    </message>
    <message>
        <source>Notes on the privileges of the bus process</source>
        <translation>Hinweise zu den Rechten des Busprozesses</translation>
    </message>
    <message>
        <source>Why no data are shown</source>
        <translation>Warum keine Daten gezeigt werden</translation>
    </message>
    <message>
        <source>Remove the cause, then open the job again.</source>
        <translation>Ursache beheben, dann den Auftrag wieder öffnen.</translation>
    </message>
    <message>
        <source>The time of this virtual bus waits for this computer: no cycle is late.</source>
        <translation>Die Zeit dieses virtuellen Busses wartet auf den Rechner: kein Zyklus ist verspätet.</translation>
    </message>
    <message>
        <source>On this computer: {names}.</source>
        <translation>An diesem Rechner: {names}.</translation>
    </message>
    <message numerus="yes">
        <source>%n older events were dropped.</source>
        <comment>1 older event was dropped.</comment>
        <translation>
            <numerusform>%n älteres Ereignis wurde verworfen.</numerusform>
            <numerusform>%n ältere Ereignisse wurden verworfen.</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{minutes:.1f} minutes, {good:.3f} % of the cycles good, %n frames lost.</source>
        <comment>{minutes:.1f} minutes, {good:.3f} % of the cycles good, 1 frame lost.</comment>
        <translation>
            <numerusform>{minutes:.1f} Minuten, {good:.3f} % der Zyklen gut, %n Bild verloren.</numerusform>
            <numerusform>{minutes:.1f} Minuten, {good:.3f} % der Zyklen gut, %n Bilder verloren.</numerusform>
        </translation>
    </message>
    <message>
        <source>ENDED</source>
        <translation>BEENDET</translation>
    </message>
    <message>
        <source>These are the last values.</source>
        <translation>Dies sind die letzten Werte.</translation>
    </message>
    <message>
        <source>NO REPORT</source>
        <translation>KEIN BERICHT</translation>
    </message>
    <message>
        <source>No report from the bus process for {age_s:.0f} s.</source>
        <translation>Seit {age_s:.0f} s kein Bericht vom Busprozess.</translation>
    </message>
    <message>
        <source>These are its last values. If this persists, open the job again.</source>
        <translation>Dies sind seine letzten Werte. Dauert es an, den Auftrag wieder öffnen.</translation>
    </message>
    <message>
        <source>{minutes:.1f} minutes, {good:.3f} % of the cycles good, no frames lost.</source>
        <translation>{minutes:.1f} Minuten, {good:.3f} % der Zyklen gut, keine Bilder verloren.</translation>
    </message>
    <message>
        <source>Press Predict. A search takes minutes; measuring continues meanwhile.</source>
        <translation>Vorhersagen drücken. Eine Suche dauert Minuten; das Messen geht weiter.</translation>
    </message>
    <message>
        <source>Predicting the rig</source>
        <translation>Kamerasystem wird vorhergesagt</translation>
    </message>
    <message>
        <source>The cameras of this machine are not those of the plan, and are not compared.</source>
        <translation>Die Kameras dieser Maschine sind nicht die des Plans und werden nicht verglichen.</translation>
    </message>
    <message>
        <source>Rig plan; empty: the rig of the thesis</source>
        <translation>Plan des Kamerasystems; leer: das der Dissertation</translation>
    </message>
    <message>
        <source>Placements</source>
        <translation>Aufstellungen</translation>
    </message>
    <message>
        <source>Placements tried by the search; 0: no search</source>
        <translation>Aufstellungen, die die Suche prüft; 0: keine Suche</translation>
    </message>
    <message>
        <source>Write to</source>
        <translation>Schreiben nach</translation>
    </message>
    <message>
        <source>Folder for the sheet (PDF) and its data (JSON); empty: not written</source>
        <translation>Ordner für das Blatt (PDF) und seine Daten (JSON); leer: nicht geschrieben</translation>
    </message>
    <message>
        <source>the rig of the thesis</source>
        <translation>das der Dissertation</translation>
    </message>
    <message>
        <source>not written</source>
        <translation>nicht geschrieben</translation>
    </message>
    <message>
        <source>Camera</source>
        <translation>Kamera</translation>
    </message>
    <message>
        <source>name in the plan</source>
        <translation>Name im Plan</translation>
    </message>
    <message>
        <source>of the projection centre, mm</source>
        <translation>des Projektionszentrums, mm</translation>
    </message>
    <message>
        <source>Azimuth °</source>
        <translation>Azimut °</translation>
    </message>
    <message>
        <source>of the view, from +Y towards +X</source>
        <translation>der Blickrichtung, von +Y nach +X</translation>
    </message>
    <message>
        <source>Elevation °</source>
        <translation>Höhe °</translation>
    </message>
    <message>
        <source>of the view, upwards</source>
        <translation>der Blickrichtung, nach oben</translation>
    </message>
    <message>
        <source>Roll °</source>
        <translation>Rollen °</translation>
    </message>
    <message>
        <source>about the optical axis</source>
        <translation>um die optische Achse</translation>
    </message>
    <message>
        <source>Planned rig</source>
        <translation>Geplantes Kamerasystem</translation>
    </message>
    <message>
        <source>Predict</source>
        <translation>Vorhersagen</translation>
    </message>
    <message>
        <source>Worst U of the tip</source>
        <translation>Größtes U der Tastspitze</translation>
    </message>
    <message>
        <source>Places of the cameras</source>
        <translation>Orte der Kameras</translation>
    </message>
    <message>
        <source>Calibrated: above</source>
        <translation>Kalibriert: oben</translation>
    </message>
    <message>
        <source>Calibrated: front</source>
        <translation>Kalibriert: vorn</translation>
    </message>
    <message>
        <source>To buy: {articles}</source>
        <translation>Zu kaufen: {articles}</translation>
    </message>
    <message>
        <source>Written: {files}</source>
        <translation>Geschrieben: {files}</translation>
    </message>
    <message>
        <source>U {worst:.1f} µm, median {median:.1f}</source>
        <translation>U {worst:.1f} µm, Median {median:.1f}</translation>
    </message>
    <message>
        <source>Name in the rig document</source>
        <translation>Name im Systemdokument</translation>
    </message>
    <message>
        <source>Serial</source>
        <translation>Seriennr.</translation>
    </message>
    <message>
        <source>Serial number</source>
        <translation>Seriennummer</translation>
    </message>
    <message>
        <source>Position on the bus, from 1</source>
        <translation>Platz am Bus, ab 1</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>State of its bus controller; OP = operational</source>
        <translation>Zustand ihres Busbausteins; OP = in Betrieb</translation>
    </message>
    <message>
        <source>AL status</source>
        <translation>AL-Status</translation>
    </message>
    <message>
        <source>Why it left operation</source>
        <translation>Warum sie den Betrieb verließ</translation>
    </message>
    <message>
        <source>Frames received</source>
        <translation>Empfangene Bilder</translation>
    </message>
    <message>
        <source>Lost</source>
        <translation>Verloren</translation>
    </message>
    <message>
        <source>Overruns</source>
        <translation>Überläufe</translation>
    </message>
    <message>
        <source>Buffer overruns</source>
        <translation>Pufferüberläufe</translation>
    </message>
    <message>
        <source>Bad</source>
        <translation>Schlecht</translation>
    </message>
    <message>
        <source>Cycles refused because of it</source>
        <translation>Ihretwegen verworfene Zyklen</translation>
    </message>
    <message>
        <source>Clock</source>
        <translation>Uhr</translation>
    </message>
    <message>
        <source>Clock offset from the bus clock, ns</source>
        <translation>Abweichung von der Busuhr, ns</translation>
    </message>
    <message>
        <source>Sensor temperature</source>
        <translation>Sensortemperatur</translation>
    </message>
    <message>
        <source>Link</source>
        <translation>Verbindung</translation>
    </message>
    <message>
        <source>Link errors counted by the camera</source>
        <translation>Von der Kamera gezählte Verbindungsfehler</translation>
    </message>
    <message>
        <source>Emerg.</source>
        <translation>Notf.</translation>
    </message>
    <message>
        <source>Emergency messages</source>
        <translation>Notfallmeldungen</translation>
    </message>
    <message>
        <source>Starts</source>
        <translation>Starts</translation>
    </message>
    <message>
        <source>Power-on count</source>
        <translation>Anzahl der Einschaltungen</translation>
    </message>
    <message>
        <source>Firmware</source>
        <translation>Firmware</translation>
    </message>
    <message>
        <source>Version it reports</source>
        <translation>Gemeldete Version</translation>
    </message>
    <message>
        <source>Time</source>
        <translation>Zeit</translation>
    </message>
    <message>
        <source>Local start time</source>
        <translation>Beginn, Ortszeit</translation>
    </message>
    <message>
        <source>Camera concerned</source>
        <translation>Betroffene Kamera</translation>
    </message>
    <message>
        <source>What happened</source>
        <translation>Was geschah</translation>
    </message>
    <message>
        <source>Description</source>
        <translation>Beschreibung</translation>
    </message>
    <message>
        <source>Who holds the probe</source>
        <translation>Wer den Taster hält</translation>
    </message>
    <message>
        <source>Pack what support needs</source>
        <translation>Packen, was der Support braucht</translation>
    </message>
    <message>
        <source>Symptoms and remedies</source>
        <translation>Symptome und Abhilfe</translation>
    </message>
    <message>
        <source>What you see</source>
        <translation>Was zu sehen ist</translation>
    </message>
    <message>
        <source>symptom, or what the program says</source>
        <translation>Symptom, oder was das Programm meldet</translation>
    </message>
    <message>
        <source>What to do</source>
        <translation>Was zu tun ist</translation>
    </message>
    <message>
        <source>in this order</source>
        <translation>in dieser Reihenfolge</translation>
    </message>
    <message>
        <source>of errors and refusals</source>
        <translation>von Fehlern und Ablehnungen</translation>
    </message>
    <message>
        <source>What to do if</source>
        <translation>Was tun, wenn</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>Suche</translation>
    </message>
    <message>
        <source>a symptom, or the code of an error</source>
        <translation>ein Symptom oder der Code eines Fehlers</translation>
    </message>
    <message numerus="yes">
        <source>%n lines</source>
        <comment>1 line</comment>
        <translation>
            <numerusform>1 Zeile</numerusform>
            <numerusform>%n Zeilen</numerusform>
        </translation>
    </message>
    <message>
        <source>Nothing found. Type less.</source>
        <translation>Nichts gefunden. Weniger eingeben.</translation>
    </message>
    <message>
        <source>Skip step</source>
        <translation>Schritt überspringen</translation>
    </message>
    <message>
        <source>Skip this step of the tour</source>
        <translation>Diesen Schritt des Rundgangs überspringen</translation>
    </message>
    <message>
        <source>SIMULATED: a virtual part. The probe rests until you measure.</source>
        <translation>SIMULIERT: ein virtuelles Werkstück. Der Taster ruht, bis Sie messen.</translation>
    </message>
    <message>
        <source>Hand back</source>
        <translation>Zurückgeben</translation>
    </message>
    <message>
        <source>SIMULATED: you measure. Move the mouse over the part and click to touch. Wheel: nearer. Arrow keys: tilt the probe. Right button: turn the view.</source>
        <translation>SIMULIERT: Sie messen. Maus über das Werkstück bewegen, Klick tastet an. Rad: näher. Pfeiltasten: Taster neigen. Rechte Taste: Ansicht drehen.</translation>
    </message>
    <message>
        <source>SIMULATED: a robot hand measures a virtual part. Take over to do it yourself.</source>
        <translation>SIMULIERT: Eine Roboterhand misst ein virtuelles Werkstück. Übernehmen, um selbst zu messen.</translation>
    </message>
    <message>
        <source>End tour</source>
        <translation>Rundgang beenden</translation>
    </message>
    <message>
        <source>Tour {number}/{count}. {sentence}</source>
        <translation>Rundgang {number}/{count}. {sentence}</translation>
    </message>
    <message>
        <source>PRACTICE: a virtual hand does what each step asks. Nothing of it is valid for measuring.</source>
        <translation>ÜBUNG (PRACTICE): Eine virtuelle Hand tut, was jeder Schritt verlangt. Nichts davon gilt zum Messen.</translation>
    </message>
    <message>
        <source>Cycles</source>
        <translation>Zyklen</translation>
    </message>
    <message>
        <source>Number of cycles affected</source>
        <translation>Anzahl betroffener Zyklen</translation>
    </message>
    <message>
        <source>Code</source>
        <translation>Code</translation>
    </message>
    <message>
        <source>For support</source>
        <translation>Für den Support</translation>
    </message>
    <message>
        <source>Cameras on the bus</source>
        <translation>Kameras am Bus</translation>
    </message>
    <message>
        <source>Events, newest first</source>
        <translation>Ereignisse, neueste zuerst</translation>
    </message>
    <message>
        <source>no error</source>
        <translation>kein Fehler</translation>
    </message>
    <message>
        <source>not found</source>
        <translation>nicht gefunden</translation>
    </message>
    <message>
        <source>NO ANSWER</source>
        <translation>KEINE ANTWORT</translation>
    </message>
    <message>
        <source>all</source>
        <translation>alle</translation>
    </message>
    <message>
        <source>Virtual cameras: the geometry of the rig document is used.</source>
        <translation>Virtuelle Kameras: es gilt die Geometrie des Systemdokuments.</translation>
    </message>
    <message>
        <source>Calibrated, verified and in date. Points can be taken.</source>
        <translation>Kalibriert, verifiziert und gültig. Punkte können aufgenommen werden.</translation>
    </message>
    <message>
        <source>No calibration of this rig is stored on this computer.</source>
        <translation>Auf diesem Rechner ist keine Kalibrierung dieses Kamerasystems gespeichert.</translation>
    </message>
    <message>
        <source>Rig</source>
        <translation>Kamerasystem</translation>
    </message>
    <message>
        <source>name in the rig document</source>
        <translation>Name im Systemdokument</translation>
    </message>
    <message>
        <source>with their serial numbers</source>
        <translation>mit ihren Seriennummern</translation>
    </message>
    <message>
        <source>calibration method</source>
        <translation>Kalibrierverfahren</translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation>Kalibriert</translation>
    </message>
    <message>
        <source>when, and by whom</source>
        <translation>wann und von wem</translation>
    </message>
    <message>
        <source>Valid until</source>
        <translation>Gültig bis</translation>
    </message>
    <message>
        <source>no points are taken after this date</source>
        <translation>danach werden keine Punkte aufgenommen</translation>
    </message>
    <message>
        <source>Positions</source>
        <translation>Positionen</translation>
    </message>
    <message>
        <source>reference positions or poses used; outliers left out</source>
        <translation>genutzte Referenzpositionen oder Lagen; Ausreißer ausgelassen</translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation>Restabweichungen</translation>
    </message>
    <message>
        <source>RMS of the residuals, and chi-square per degree of freedom</source>
        <translation>RMS der Restabweichungen und Chi-Quadrat je Freiheitsgrad</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>calibrated volume, mm</source>
        <translation>kalibriertes Volumen, mm</translation>
    </message>
    <message>
        <source>Warmth</source>
        <translation>Wärme</translation>
    </message>
    <message>
        <source>ambient and sensor temperatures during calibration</source>
        <translation>Raum- und Sensortemperatur beim Kalibrieren</translation>
    </message>
    <message>
        <source>traceability: artefacts with serial numbers</source>
        <translation>Rückführung: Prüfkörper mit Seriennummern</translation>
    </message>
    <message>
        <source>Verified</source>
        <translation>Verifiziert</translation>
    </message>
    <message>
        <source>date, and the error closest to its limit</source>
        <translation>Datum und die Abweichung, die ihrer Grenze am nächsten liegt</translation>
    </message>
    <message>
        <source>Hash</source>
        <translation>Hash</translation>
    </message>
    <message>
        <source>of the record or rig document; printed in jobs and reports</source>
        <translation>von Protokoll oder Systemdokument; steht in Aufträgen und Berichten</translation>
    </message>
    <message>
        <source>Recall jobs (F12) shows which of their verdicts hold.</source>
        <translation>Der Rückruf (F12) zeigt, welche ihrer Urteile gelten.</translation>
    </message>
    <message>
        <source>Calibration</source>
        <translation>Kalibrierung</translation>
    </message>
    <message>
        <source>Status of the calibration</source>
        <translation>Stand der Kalibrierung</translation>
    </message>
    <message>
        <source>Focal length, Δ µm</source>
        <translation>Brennweite, Δ µm</translation>
    </message>
    <message>
        <source>Principal point, Δu px</source>
        <translation>Bildhauptpunkt, Δu px</translation>
    </message>
    <message>
        <source>Principal point, Δv px</source>
        <translation>Bildhauptpunkt, Δv px</translation>
    </message>
    <message>
        <source>Camera distance, Δ µm</source>
        <translation>Kameraabstand, Δ µm</translation>
    </message>
    <message>
        <source>Verified error, % of limit</source>
        <translation>Verifizierte Abweichung, % der Grenze</translation>
    </message>
    <message>
        <source>{low} to {high} mm</source>
        <translation>{low} bis {high} mm</translation>
    </message>
    <message>
        <source>none, the rig document</source>
        <translation>keine, das Systemdokument</translation>
    </message>
    <message>
        <source>{made_utc}, {error_mm:+.1f} of ±{limit_mm:.1f} µm</source>
        <translation>{made_utc}, {error_mm:+.1f} von ±{limit_mm:.1f} µm</translation>
    </message>
    <message numerus="yes">
        <source>%n left out</source>
        <translation>
            <numerusform>%n ausgelassen</numerusform>
            <numerusform>%n ausgelassen</numerusform>
        </translation>
    </message>
    <message>
        <source>{around} °C, sensors {sensors} °C</source>
        <translation>{around} °C, Sensoren {sensors} °C</translation>
    </message>
    <message>
        <source>Calibration concerned, see the last column</source>
        <translation>Betroffene Kalibrierung, siehe letzte Spalte</translation>
    </message>
    <message>
        <source>Why</source>
        <translation>Grund</translation>
    </message>
    <message>
        <source>As entered, or the rule applied</source>
        <translation>Wie eingegeben, oder die angewandte Regel</translation>
    </message>
    <message>
        <source>Good until</source>
        <translation>Gut bis</translation>
    </message>
    <message>
        <source>If suspect: last time known good</source>
        <translation>Bei Zweifel: zuletzt als gut bekannt</translation>
    </message>
    <message>
        <source>First digits of its hash</source>
        <translation>Erste Stellen des Hashs</translation>
    </message>
    <message>
        <source>Activated</source>
        <translation>In Kraft gesetzt</translation>
    </message>
    <message>
        <source>Verification passed</source>
        <translation>Verifikation bestanden</translation>
    </message>
    <message>
        <source>Verification FAILED</source>
        <translation>Verifikation NICHT BESTANDEN</translation>
    </message>
    <message>
        <source>Marked suspect</source>
        <translation>Als fraglich markiert</translation>
    </message>
    <message>
        <source>Artefact found WRONG</source>
        <translation>Prüfkörper als FALSCH erkannt</translation>
    </message>
    <message>
        <source>Jobs recalled</source>
        <translation>Aufträge zurückgerufen</translation>
    </message>
    <message>
        <source>History, newest first</source>
        <translation>Verlauf, neueste zuerst</translation>
    </message>
    <message>
        <source>This overwrites the intrinsics stored in the cameras with those of the active calibration. Press W again to confirm.</source>
        <translation>Dies überschreibt die in den Kameras gespeicherten Abbildungsparameter mit denen der aktiven Kalibrierung. Zur Bestätigung W nochmals drücken.</translation>
    </message>
    <message>
        <source>No tip calibrated yet: calibrate the probe with this tip.</source>
        <translation>Noch keine Tastspitze kalibriert: Taster mit dieser Tastspitze kalibrieren.</translation>
    </message>
    <message>
        <source>Confirm that tip &apos;{tip}&apos; is now mounted? It must be checked before points are taken. Press N again to confirm.</source>
        <translation>Ist Tastspitze „{tip}“ jetzt montiert? Vor dem ersten Punkt muss sie geprüft werden. Zur Bestätigung N nochmals drücken.</translation>
    </message>
    <message>
        <source>tip {tip}</source>
        <translation>Tastspitze {tip}</translation>
    </message>
    <message>
        <source>good</source>
        <translation>gut</translation>
    </message>
    <message>
        <source>late</source>
        <translation>spät</translation>
    </message>
    <message>
        <source>lost</source>
        <translation>verloren</translation>
    </message>
    <message>
        <source>bad</source>
        <translation>schlecht</translation>
    </message>
    <message>
        <source>Bus cycles</source>
        <translation>Buszyklen</translation>
    </message>
    <message>
        <source>wrong</source>
        <translation>falsch</translation>
    </message>
    <message>
        <source>elapsed</source>
        <translation>vergangen</translation>
    </message>
    <message>
        <source>Select a folder of certified reference pairs (NAME.ds with NAME.fit) and the convention they follow. Every pair is fitted without a start value and compared.</source>
        <translation>Ordner mit zertifizierten Referenzpaaren (NAME.ds mit NAME.fit) und ihre Konvention wählen. Jedes Paar wird ohne Startwert eingepasst und verglichen.</translation>
    </message>
    <message>
        <source>Folder</source>
        <translation>Ordner</translation>
    </message>
    <message>
        <source>one folder of pairs</source>
        <translation>ein Ordner mit Paaren</translation>
    </message>
    <message>
        <source>Pairs</source>
        <translation>Paare</translation>
    </message>
    <message>
        <source>pairs fitted and compared</source>
        <translation>eingepasste und verglichene Paare</translation>
    </message>
    <message>
        <source>mm, worst; limit {limit:g}</source>
        <translation>mm, größte; Grenze {limit:g}</translation>
    </message>
    <message>
        <source>Size</source>
        <translation>Größe</translation>
    </message>
    <message>
        <source>Direction</source>
        <translation>Richtung</translation>
    </message>
    <message>
        <source>rad, worst; limit {limit:g}</source>
        <translation>rad, größte; Grenze {limit:g}</translation>
    </message>
    <message>
        <source>Apex</source>
        <translation>Spitze</translation>
    </message>
    <message>
        <source>degrees, worst; limit {limit:g}</source>
        <translation>Grad, größte; Grenze {limit:g}</translation>
    </message>
    <message>
        <source>whether every pair is within the limits</source>
        <translation>ob alle Paare innerhalb der Grenzen liegen</translation>
    </message>
    <message>
        <source>Fitting</source>
        <translation>Wird eingepasst</translation>
    </message>
    <message>
        <source>Fits against certified pairs</source>
        <translation>Einpassungen gegen zertifizierte Paare</translation>
    </message>
    <message>
        <source>Folder of reference pairs</source>
        <translation>Ordner der Referenzpaare</translation>
    </message>
    <message>
        <source>Convention</source>
        <translation>Konvention</translation>
    </message>
    <message>
        <source>Convention of the certified values</source>
        <translation>Konvention der zertifizierten Werte</translation>
    </message>
    <message>
        <source>Outcome</source>
        <translation>Ergebnis</translation>
    </message>
    <message>
        <source>What is compared</source>
        <translation>Was verglichen wird</translation>
    </message>
    <message>
        <source>Worst errors</source>
        <translation>Größte Abweichungen</translation>
    </message>
    <message>
        <source>Progress of the comparison</source>
        <translation>Fortschritt des Vergleichs</translation>
    </message>
    <message>
        <source>All {pairs} pairs within the limits</source>
        <translation>Alle {pairs} Paare innerhalb der Grenzen</translation>
    </message>
    <message>
        <source>{beyond} of {pairs} pairs beyond the limits</source>
        <translation>{beyond} von {pairs} Paaren außerhalb der Grenzen</translation>
    </message>
    <message>
        <source>✔  AGREES</source>
        <translation>✔  STIMMT</translation>
    </message>
    <message>
        <source>✖  OFF</source>
        <translation>✖  WEICHT AB</translation>
    </message>
    <message>
        <source>Status</source>
        <translation>Stand</translation>
    </message>
    <message>
        <source>INACCURATE</source>
        <translation>UNGENAU</translation>
    </message>
    <message>
        <source>Pages</source>
        <translation>Seiten</translation>
    </message>
    <message>
        <source>Up and down select a page</source>
        <translation>Auf und Ab wählen eine Seite</translation>
    </message>
    <message>
        <source>Inspect  [M]</source>
        <translation>Messen  [M]</translation>
    </message>
    <message>
        <source>Press Examine. It takes a few seconds; measuring continues meanwhile.</source>
        <translation>„Untersuchen“ drücken. Es dauert einige Sekunden; das Messen geht weiter.</translation>
    </message>
    <message>
        <source>Probe</source>
        <translation>Taster</translation>
    </message>
    <message>
        <source>Probe document; empty: the probe in use</source>
        <translation>Tasterdokument; leer: der Taster in Gebrauch</translation>
    </message>
    <message>
        <source>Design</source>
        <translation>Konstruktion</translation>
    </message>
    <message>
        <source>Design document (materials, sections); empty: the one in the resources folder</source>
        <translation>Konstruktionsdokument (Werkstoffe, Querschnitte); leer: das mitgelieferte</translation>
    </message>
    <message>
        <source>Tilts, °</source>
        <translation>Neigungen, °</translation>
    </message>
    <message>
        <source>Largest tilts of the probe about X, Y and Z</source>
        <translation>Größte Neigungen des Tasters um X, Y und Z</translation>
    </message>
    <message>
        <source>Spots, px</source>
        <translation>Lichtpunkte, px</translation>
    </message>
    <message>
        <source>Noise of an averaged spot</source>
        <translation>Rauschen eines gemittelten Lichtpunkts</translation>
    </message>
    <message>
        <source>the probe in use</source>
        <translation>der Taster in Gebrauch</translation>
    </message>
    <message>
        <source>the one in the resources folder</source>
        <translation>das mitgelieferte</translation>
    </message>
    <message>
        <source>of the uncertainty of one point</source>
        <translation>der Unsicherheit eines Punkts</translation>
    </message>
    <message>
        <source>standard uncertainty in space, RMS over the poses</source>
        <translation>räumliche Standardunsicherheit, RMS über die Lagen</translation>
    </message>
    <message>
        <source>Rests on</source>
        <translation>Beruht auf</translation>
    </message>
    <message>
        <source>source values</source>
        <translation>Ausgangswerten</translation>
    </message>
    <message>
        <source>Design of the probe</source>
        <translation>Konstruktion des Tasters</translation>
    </message>
    <message>
        <source>Examine</source>
        <translation>Untersuchen</translation>
    </message>
    <message>
        <source>Uncertainty of the tip</source>
        <translation>Messunsicherheit der Tastspitze</translation>
    </message>
    <message>
        <source>Computing. Numbers and maps below are from the previous run.</source>
        <translation>Rechnet. Zahlen und Karten unten sind vom vorigen Lauf.</translation>
    </message>
    <message>
        <source>Meaning of the number</source>
        <translation>Bedeutung der Zahl</translation>
    </message>
    <message>
        <source>Labels</source>
        <translation>Zuordnung der LEDs</translation>
    </message>
    <message>
        <source>Nearest wrong orders</source>
        <translation>Nächste falsche Zuordnungen</translation>
    </message>
    <message>
        <source>Growth and bending</source>
        <translation>Wachsen und Biegen</translation>
    </message>
    <message>
        <source>Over the tilt</source>
        <translation>Über die Neigung</translation>
    </message>
    <message>
        <source>From above</source>
        <translation>Von oben</translation>
    </message>
    <message>
        <source>From the front</source>
        <translation>Von vorn</translation>
    </message>
    <message>
        <source>Tilts</source>
        <translation>Neigungen</translation>
    </message>
    <message>
        <source>Spots</source>
        <translation>Lichtpunkte</translation>
    </message>
    <message>
        <source>Starting</source>
        <translation>Beginnt</translation>
    </message>
    <message>
        <source>LEDs cannot be confused</source>
        <translation>LEDs sind nicht zu verwechseln</translation>
    </message>
    <message>
        <source>LEDs can be confused</source>
        <translation>LEDs sind zu verwechseln</translation>
    </message>
    <message>
        <source>Standard uncertainty of the tip in space from spot noise alone, probe &apos;{probe}&apos; with rig &apos;{rig}&apos;: X {x:.1f}, Y {y:.1f}, Z {z:.1f} µm; below {p95_um:.1f} µm in 95 of 100 poses. {share:.0f} % of the poses give a tip.</source>
        <translation>Räumliche Standardunsicherheit der Tastspitze allein aus dem Rauschen der Lichtpunkte, Taster „{probe}“ mit Kamerasystem „{rig}“: X {x:.1f}, Y {y:.1f}, Z {z:.1f} µm; unter {p95_um:.1f} µm in 95 von 100 Lagen. {share:.0f} % der Lagen ergeben einen Punkt.</translation>
    </message>
    <message>
        <source>No pose gives a tip: the cameras do not see enough LEDs.</source>
        <translation>Keine Lage ergibt einen Punkt: die Kameras sehen zu wenige LEDs.</translation>
    </message>
    <message>
        <source>Thermal growth and bending need a design document.</source>
        <translation>Wärmedehnung und Biegung brauchen ein Konstruktionsdokument.</translation>
    </message>
    <message>
        <source>Budget of one point</source>
        <translation>Budget eines Punkts</translation>
    </message>
    <message>
        <source>Virtual probe: the geometry of its document is used.</source>
        <translation>Virtueller Taster: es gilt die Geometrie seines Dokuments.</translation>
    </message>
    <message>
        <source>Calibrated, qualified and in date. Points can be taken.</source>
        <translation>Kalibriert, eingemessen und gültig. Punkte können aufgenommen werden.</translation>
    </message>
    <message>
        <source>No records of this probe are stored on this computer.</source>
        <translation>Auf diesem Rechner sind keine Aufzeichnungen dieses Tasters gespeichert.</translation>
    </message>
    <message>
        <source>No tip calibrated yet: press P to calibrate the probe with the mounted tip.</source>
        <translation>Noch keine Tastspitze kalibriert: P drücken, um den Taster mit der montierten Tastspitze zu kalibrieren.</translation>
    </message>
    <message>
        <source>name in its document</source>
        <translation>Name im Dokument</translation>
    </message>
    <message>
        <source>Tip</source>
        <translation>Tastspitze</translation>
    </message>
    <message>
        <source>currently mounted</source>
        <translation>jetzt montiert</translation>
    </message>
    <message>
        <source>Ball</source>
        <translation>Tastkugel</translation>
    </message>
    <message>
        <source>diameter used for compensation</source>
        <translation>für die Kompensation genutzter Durchmesser</translation>
    </message>
    <message>
        <source>Qualified</source>
        <translation>Eingemessen</translation>
    </message>
    <message>
        <source>Effective diameter and its U (k = 2)</source>
        <translation>Wirksamer Durchmesser und sein U (k = 2)</translation>
    </message>
    <message>
        <source>ambient, at probe calibration and tip qualification</source>
        <translation>Raum, beim Kalibrieren und Einmessen</translation>
    </message>
    <message>
        <source>Turned</source>
        <translation>Gedreht</translation>
    </message>
    <message>
        <source>rotation about the probe axes during calibration</source>
        <translation>Drehung um die Tasterachsen beim Kalibrieren</translation>
    </message>
    <message>
        <source>of the source of the geometry; printed in jobs and reports</source>
        <translation>der Quelle der Geometrie; steht in Aufträgen und Berichten</translation>
    </message>
    <message>
        <source>Status of the probe</source>
        <translation>Stand des Tasters</translation>
    </message>
    <message>
        <source>Ball diameter, Δ µm</source>
        <translation>Kugeldurchmesser, Δ µm</translation>
    </message>
    <message>
        <source>Form, µm</source>
        <translation>Form, µm</translation>
    </message>
    <message>
        <source>Tip from first position, µm</source>
        <translation>Tastspitze von der ersten Lage, µm</translation>
    </message>
    <message>
        <source>Quick check, % of limit</source>
        <translation>Kurzprüfung, % der Grenze</translation>
    </message>
    <message>
        <source>Name; an arrow marks the mounted tip</source>
        <translation>Name; der Pfeil zeigt die montierte Tastspitze</translation>
    </message>
    <message>
        <source>Standing</source>
        <translation>Stand</translation>
    </message>
    <message>
        <source>Status of the tip</source>
        <translation>Stand der Tastspitze</translation>
    </message>
    <message>
        <source>Ball, mm</source>
        <translation>Tastkugel, mm</translation>
    </message>
    <message>
        <source>Largest minus smallest radius</source>
        <translation>Größter minus kleinster Radius</translation>
    </message>
    <message>
        <source>Cone, µm</source>
        <translation>Kegelsitz, µm</translation>
    </message>
    <message>
        <source>Two standard deviations of the tip over all attitudes</source>
        <translation>Zwei Standardabweichungen der Kugelmitte über alle Stellungen</translation>
    </message>
    <message>
        <source>Date and temperature</source>
        <translation>Datum und Temperatur</translation>
    </message>
    <message>
        <source>Checked</source>
        <translation>Geprüft</translation>
    </message>
    <message>
        <source>Last quick check since then</source>
        <translation>Letzte Kurzprüfung seitdem</translation>
    </message>
    <message>
        <source>No points are taken with it after this date</source>
        <translation>Danach werden keine Punkte mit ihr aufgenommen</translation>
    </message>
    <message>
        <source>Record concerned, see the last column</source>
        <translation>Betroffenes Protokoll, siehe letzte Spalte</translation>
    </message>
    <message>
        <source>Its name</source>
        <translation>Ihr Name</translation>
    </message>
    <message>
        <source>Tips</source>
        <translation>Tastspitzen</translation>
    </message>
    <message>
        <source>Up and down select a tip</source>
        <translation>Auf und Ab wählen eine Tastspitze</translation>
    </message>
    <message>
        <source>never</source>
        <translation>nie</translation>
    </message>
    <message>
        <source>passed</source>
        <translation>bestanden</translation>
    </message>
    <message>
        <source>FAILED</source>
        <translation>NICHT BESTANDEN</translation>
    </message>
    <message>
        <source>Recall a folder</source>
        <translation>Rückruf eines Ordners</translation>
    </message>
    <message>
        <source>Recalculate the suspect jobs in a folder</source>
        <translation>Fragliche Aufträge eines Ordners neu berechnen</translation>
    </message>
    <message>
        <source>Stop recalculating; nothing is changed</source>
        <translation>Neuberechnung anhalten; nichts wird geändert</translation>
    </message>
    <message>
        <source>Write PDF</source>
        <translation>PDF schreiben</translation>
    </message>
    <message>
        <source>Write the recall report (PDF)</source>
        <translation>Bericht des Rückrufs schreiben (PDF)</translation>
    </message>
    <message>
        <source>Release points</source>
        <translation>Punkte freigeben</translation>
    </message>
    <message>
        <source>Release points whose verdicts hold, under your name</source>
        <translation>Punkte, deren Urteile gelten, unter eigenem Namen freigeben</translation>
    </message>
    <message>
        <source>file of the job</source>
        <translation>Datei des Auftrags</translation>
    </message>
    <message>
        <source>as in the plan</source>
        <translation>wie im Plan</translation>
    </message>
    <message>
        <source>value ± U and verdict with the calibration of the job</source>
        <translation>Wert ± U und Urteil mit der Kalibrierung des Auftrags</translation>
    </message>
    <message>
        <source>the same with the calibration its spots support</source>
        <translation>dasselbe mit der Kalibrierung, die seine Lichtpunkte stützen</translation>
    </message>
    <message>
        <source>whether the verdict still holds</source>
        <translation>ob das Urteil noch gilt</translation>
    </message>
    <message>
        <source>and why</source>
        <translation>und warum</translation>
    </message>
    <message>
        <source>Storing the recall</source>
        <translation>Rückruf wird gespeichert</translation>
    </message>
    <message numerus="yes">
        <source>{title}: %n rows. {place}</source>
        <comment>{title}: 1 row. {place}</comment>
        <translation>
            <numerusform>{title}: %n Zeile. {place}</numerusform>
            <numerusform>{title}: %n Zeilen. {place}</numerusform>
        </translation>
    </message>
    <message>
        <source>Creating the pages</source>
        <translation>Seiten werden erstellt</translation>
    </message>
    <message>
        <source>Verdicts of the recall</source>
        <translation>Urteile des Rückrufs</translation>
    </message>
    <message>
        <source>Recall</source>
        <translation>Rückruf</translation>
    </message>
    <message>
        <source>Recalculating the jobs</source>
        <translation>Aufträge werden neu berechnet</translation>
    </message>
    <message>
        <source>Recall the jobs from the folder</source>
        <translation>Rückruf der Aufträge des Ordners</translation>
    </message>
    <message>
        <source>Write the recall into the file</source>
        <translation>Rückruf in die Datei schreiben</translation>
    </message>
    <message>
        <source>File of the recall</source>
        <translation>Datei des Rückrufs</translation>
    </message>
    <message>
        <source>Write</source>
        <translation>Schreiben</translation>
    </message>
    <message>
        <source>what the histories tell</source>
        <translation>was die Historien sagen</translation>
    </message>
    <message>
        <source>artefact</source>
        <translation>Prüfkörper</translation>
    </message>
    <message>
        <source>tip</source>
        <translation>Tastspitze</translation>
    </message>
    <message>
        <source>calibration</source>
        <translation>Kalibrierung</translation>
    </message>
    <message>
        <source>serial number, name or hash</source>
        <translation>Seriennummer, Name oder Hash</translation>
    </message>
    <message>
        <source>Wrong since</source>
        <translation>Falsch seit</translation>
    </message>
    <message>
        <source>day, e.g. 2026-11-26</source>
        <translation>Tag, z. B. 2026-11-26</translation>
    </message>
    <message>
        <source>Calibrations</source>
        <translation>Kalibrierungen</translation>
    </message>
    <message>
        <source>folders of the stations; empty: this computer</source>
        <translation>Ordner der Stationen; leer: dieser Rechner</translation>
    </message>
    <message>
        <source>who decides; to store it</source>
        <translation>wer entscheidet; zum Speichern</translation>
    </message>
    <message>
        <source>Finding</source>
        <translation>Befund</translation>
    </message>
    <message>
        <source>What was found to be wrong</source>
        <translation>Was sich als falsch erwies</translation>
    </message>
    <message>
        <source>Result of the recall</source>
        <translation>Ergebnis des Rückrufs</translation>
    </message>
    <message>
        <source>Findings of the recall</source>
        <translation>Befunde des Rückrufs</translation>
    </message>
    <message>
        <source>Evidence for the selected verdict</source>
        <translation>Belege zum ausgewählten Urteil</translation>
    </message>
    <message>
        <source>What was wrong, or since when, is missing.</source>
        <translation>Es fehlt, was falsch war oder seit wann.</translation>
    </message>
    <message>
        <source>Fill in both, then recall (F8).</source>
        <translation>Beides ausfüllen, dann Rückruf rechnen (F8).</translation>
    </message>
    <message>
        <source>No recall is shown yet.</source>
        <translation>Es wird noch kein Rückruf gezeigt.</translation>
    </message>
    <message>
        <source>Recall first (F8).</source>
        <translation>Erst den Rückruf rechnen (F8).</translation>
    </message>
    <message>
        <source>Select the folder with the jobs (F7). Job files are not changed.</source>
        <translation>Ordner mit den Aufträgen wählen (F7). Auftragsdateien werden nicht geändert.</translation>
    </message>
    <message>
        <source>Checks the jobs in {folder}. Job files are not changed.</source>
        <translation>Prüft die Aufträge in {folder}. Auftragsdateien werden nicht geändert.</translation>
    </message>
    <message>
        <source>Recall written to {path}.</source>
        <translation>Rückruf in {path} geschrieben.</translation>
    </message>
    <message>
        <source>Meaning of the status</source>
        <translation>Bedeutung des Stands</translation>
    </message>
    <message>
        <source>Watch list</source>
        <translation>Beobachtungsliste</translation>
    </message>
    <message>
        <source>Why no history is shown</source>
        <translation>Warum kein Verlauf gezeigt wird</translation>
    </message>
    <message>
        <source>UNCALIBRATED</source>
        <translation>UNKALIBRIERT</translation>
    </message>
    <message>
        <source>Points since {since_utc} are suspect, also in older jobs.</source>
        <translation>Punkte seit {since_utc} sind fraglich, auch in älteren Aufträgen.</translation>
    </message>
    <message>
        <source>Points are taken but prove nothing: every verdict is NOT PROVEN.{why}</source>
        <translation>Punkte werden aufgenommen, beweisen aber nichts: jedes Urteil ist NICHT NACHGEWIESEN.{why}</translation>
    </message>
    <message>
        <source>No points are taken. {blocker}</source>
        <translation>Es werden keine Punkte aufgenommen. {blocker}</translation>
    </message>
    <message>
        <source>Wire</source>
        <translation>Kabel</translation>
    </message>
    <message>
        <source>{link} cable to {name}, {state}</source>
        <translation>Kabel {link} zu {name}, {state}</translation>
    </message>
    <message>
        <source>this computer</source>
        <translation>dieser Rechner</translation>
    </message>
    <message>
        <source>Camera sees no LED: {names}</source>
        <translation>Kamera sieht keine LED: {names}</translation>
    </message>
    <message numerus="yes">
        <source>{name}: %n spots</source>
        <comment>{name}: 1 spot</comment>
        <translation>
            <numerusform>{name}: %n Lichtpunkt</numerusform>
            <numerusform>{name}: %n Lichtpunkte</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{count} cameras, at least %n spots each</source>
        <comment>{count} cameras, at least 1 spot each</comment>
        <translation>
            <numerusform>{count} Kameras, je mindestens %n Lichtpunkt</numerusform>
            <numerusform>{count} Kameras, je mindestens %n Lichtpunkte</numerusform>
        </translation>
    </message>
    <message>
        <source>Coverage of the feature</source>
        <translation>Abdeckung des Elements</translation>
    </message>
    <message>
        <source>no points</source>
        <translation>keine Punkte</translation>
    </message>
    <message>
        <source>Operator and part</source>
        <translation>Bediener und Werkstück</translation>
    </message>
    <message>
        <source>Temperatures</source>
        <translation>Temperaturen</translation>
    </message>
    <message numerus="yes">
        <source>{part}   {done} / %n features</source>
        <comment>{part}   {done} / 1 feature</comment>
        <translation>
            <numerusform>{part}   {done} / %n Element</numerusform>
            <numerusform>{part}   {done} / %n Elemente</numerusform>
        </translation>
    </message>
    <message>
        <source>Next step</source>
        <translation>Nächster Schritt</translation>
    </message>
    <message>
        <source>Measured</source>
        <translation>Gemessen</translation>
    </message>
    <message>
        <source>Deviation</source>
        <translation>Abweichung</translation>
    </message>
    <message>
        <source>Points</source>
        <translation>Punkte</translation>
    </message>
    <message>
        <source>Feature name</source>
        <translation>Name des Elements</translation>
    </message>
    <message>
        <source>NOT MEASURED</source>
        <translation>NICHT GEMESSEN</translation>
    </message>
    <message>
        <source>{name}, description</source>
        <translation>{name}, Beschreibung</translation>
    </message>
    <message numerus="yes">
        <source>{taken} of %n points</source>
        <comment>{taken} of 1 point</comment>
        <translation>
            <numerusform>{taken} von %n Punkt</numerusform>
            <numerusform>{taken} von %n Punkten</numerusform>
        </translation>
    </message>
    <message>
        <source>Other characteristics of this feature</source>
        <translation>Weitere Merkmale dieses Elements</translation>
    </message>
    <message>
        <source>Also</source>
        <translation>Auch</translation>
    </message>
    <message>
        <source>deviation</source>
        <translation>Abweichung</translation>
    </message>
    <message>
        <source>Nominal</source>
        <translation>Nennmaß</translation>
    </message>
    <message>
        <source>Feature</source>
        <translation>Element</translation>
    </message>
    <message>
        <source>Association and frame</source>
        <translation>Zuordnung und Koordinatensystem</translation>
    </message>
    <message>
        <source>Outliers</source>
        <translation>Ausreißer</translation>
    </message>
    <message>
        <source>1 of 3 NOT MEASURED</source>
        <translation>1 von 3 NICHT GEMESSEN</translation>
    </message>
    <message>
        <source>Note</source>
        <translation>Hinweis</translation>
    </message>
    <message>
        <source>No tolerance on this feature.</source>
        <translation>Keine Toleranz an diesem Element.</translation>
    </message>
    <message>
        <source>Approach tone on.</source>
        <translation>Annäherungston ein.</translation>
    </message>
    <message>
        <source>Approach tone off.</source>
        <translation>Annäherungston aus.</translation>
    </message>
    <message>
        <source>Instruction of the plan</source>
        <translation>Anweisung des Plans</translation>
    </message>
    <message>
        <source>Probing order and probe side</source>
        <translation>Reihenfolge und Antastseite</translation>
    </message>
    <message>
        <source>Approach to the next point</source>
        <translation>Annäherung an den nächsten Punkt</translation>
    </message>
    <message>
        <source>Blocking reason</source>
        <translation>Was hindert</translation>
    </message>
    <message>
        <source>Next part</source>
        <translation>Nächstes Werkstück</translation>
    </message>
    <message>
        <source>Next serial number, all other fields unchanged</source>
        <translation>Nächste Seriennummer, alle anderen Felder unverändert</translation>
    </message>
    <message>
        <source>Other plan</source>
        <translation>Anderer Plan</translation>
    </message>
    <message>
        <source>Choose another plan file</source>
        <translation>Andere Plandatei wählen</translation>
    </message>
    <message>
        <source>Resume the selected job</source>
        <translation>Ausgewählten Auftrag fortsetzen</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Start the page for the tablet</source>
        <translation>Die Seite für das Tablet starten</translation>
    </message>
    <message>
        <source>End the page on all tablets</source>
        <translation>Die Seite auf allen Tablets beenden</translation>
    </message>
    <message>
        <source>Second screen</source>
        <translation>Zweiter Bildschirm</translation>
    </message>
    <message>
        <source>QR code of the page</source>
        <translation>QR-Code der Seite</translation>
    </message>
    <message>
        <source>Open pages</source>
        <translation>Geöffnete Seiten</translation>
    </message>
    <message>
        <source>About the connection</source>
        <translation>Zur Verbindung</translation>
    </message>
    <message>
        <source>Address of the page</source>
        <translation>Adresse der Seite</translation>
    </message>
    <message>
        <source>Scan the code with the camera of the tablet; the page opens in its browser.</source>
        <translation>Scannen Sie den Code mit der Kamera des Tablets; die Seite öffnet sich in dessen Browser.</translation>
    </message>
    <message>
        <source>The second screen is off.</source>
        <translation>Der zweite Bildschirm ist aus.</translation>
    </message>
    <message numerus="yes">
        <source>%n pages are open.</source>
        <comment>One page is open.</comment>
        <translation>
            <numerusform>Eine Seite ist geöffnet.</numerusform>
            <numerusform>%n Seiten sind geöffnet.</numerusform>
        </translation>
    </message>
    <message>
        <source>No page is open yet.</source>
        <translation>Noch ist keine Seite geöffnet.</translation>
    </message>
    <message>
        <source>Start a job for this part</source>
        <translation>Auftrag für dieses Werkstück beginnen</translation>
    </message>
    <message>
        <source>Operator</source>
        <translation>Bediener</translation>
    </message>
    <message>
        <source>Name of the operator</source>
        <translation>Name des Prüfers</translation>
    </message>
    <message>
        <source>Of the part; - if it has none</source>
        <translation>Des Werkstücks; - wenn es keine hat</translation>
    </message>
    <message>
        <source>Order number; optional</source>
        <translation>Bestellnummer; freiwillig</translation>
    </message>
    <message>
        <source>Order no.</source>
        <translation>Bestell-Nr.</translation>
    </message>
    <message>
        <source>Batch</source>
        <translation>Serie</translation>
    </message>
    <message>
        <source>Groups parts for comparison; optional</source>
        <translation>Fasst Werkstücke zum Vergleich zusammen; freiwillig</translation>
    </message>
    <message>
        <source>optional; Return keeps all three</source>
        <translation>optional; Eingabetaste übernimmt alle drei</translation>
    </message>
    <message>
        <source>Plan of the next job</source>
        <translation>Plan des nächsten Auftrags</translation>
    </message>
    <message>
        <source>Choose the plan from the file</source>
        <translation>Plan aus Datei wählen</translation>
    </message>
    <message>
        <source>Choose</source>
        <translation>Wählen</translation>
    </message>
    <message>
        <source>Part</source>
        <translation>Werkstück</translation>
    </message>
    <message>
        <source>What to do next</source>
        <translation>Was als Nächstes zu tun ist</translation>
    </message>
    <message>
        <source>Return moves to the next field and, after the last one, starts the job. Unfinished jobs are saved with all their points and paused when the next job has another plan; choose Continue to resume.</source>
        <translation>Die Eingabetaste geht zum nächsten Feld und beginnt nach dem letzten den Auftrag. Unfertige Aufträge sind mit allen Punkten gespeichert und werden angehalten, wenn der nächste einen anderen Plan hat; „Fortsetzen“ führt sie weiter.</translation>
    </message>
    <message>
        <source>Jobs of this batch</source>
        <translation>Aufträge dieser Serie</translation>
    </message>
    <message>
        <source>Up and down select a job; F7 resumes it</source>
        <translation>Auf und Ab wählen einen Auftrag; F7 setzt ihn fort</translation>
    </message>
    <message>
        <source>Which jobs</source>
        <translation>Welche Aufträge</translation>
    </message>
    <message>
        <source>What the job keeps of the room</source>
        <translation>Was der Auftrag vom Raum behält</translation>
    </message>
    <message>
        <source>Current job: nothing was read off in the room.</source>
        <translation>Aktueller Auftrag: Im Raum wurde nichts abgelesen.</translation>
    </message>
    <message>
        <source>Current job: {job}.</source>
        <translation>Laufender Auftrag: {job}.</translation>
    </message>
    <message>
        <source>Select a job in the list first.</source>
        <translation>Zuerst einen Auftrag in der Liste wählen.</translation>
    </message>
    <message>
        <source>Starting the job</source>
        <translation>Auftrag wird begonnen</translation>
    </message>
    <message>
        <source>{name} (current job)</source>
        <translation>{name} (laufender Auftrag)</translation>
    </message>
    <message>
        <source>changed since</source>
        <translation>seitdem geändert</translation>
    </message>
    <message>
        <source>Part {part}</source>
        <translation>Werkstück {part}</translation>
    </message>
    <message>
        <source>Reading jobs in {folder}</source>
        <translation>Aufträge in {folder} werden gelesen</translation>
    </message>
    <message>
        <source>Serial {serial}: {points}, {operator}, {when} UTC, {name}</source>
        <translation>Serien-Nr. {serial}: {points}, {operator}, {when} UTC, {name}</translation>
    </message>
    <message>
        <source>of batch {batch}</source>
        <translation>der Serie {batch}</translation>
    </message>
    <message>
        <source>without a batch</source>
        <translation>ohne Serie</translation>
    </message>
    <message>
        <source>Other jobs {of}, in {folder}: {count}</source>
        <translation>Andere Aufträge {of}, in {folder}: {count}</translation>
    </message>
    <message>
        <source>Verdict on the part</source>
        <translation>Urteil über das Werkstück</translation>
    </message>
    <message numerus="yes">
        <source>%n more</source>
        <translation>
            <numerusform>noch %n</numerusform>
            <numerusform>noch %n</numerusform>
        </translation>
    </message>
    <message>
        <source>Features in probing order; Page Up and Page Down change the active one</source>
        <translation>Elemente in Messreihenfolge; Bild↑ und Bild↓ wechseln das aktive</translation>
    </message>
    <message>
        <source>No points to select yet.</source>
        <translation>Noch keine Punkte zum Auswählen.</translation>
    </message>
    <message>
        <source>Select a point first: press . or , or click its bar.</source>
        <translation>Zuerst einen Punkt wählen: . oder , drücken oder seinen Balken anklicken.</translation>
    </message>
    <message>
        <source>No deleted points on this feature.</source>
        <translation>Keine gelöschten Punkte an diesem Element.</translation>
    </message>
    <message>
        <source>Readout</source>
        <translation>Anzeige</translation>
    </message>
    <message>
        <source>no valid position</source>
        <translation>keine gültige Position</translation>
    </message>
    <message>
        <source>world frame</source>
        <translation>Weltsystem</translation>
    </message>
    <message>
        <source>by &apos;{name}&apos;</source>
        <translation>mit „{name}“</translation>
    </message>
    <message>
        <source>ball centre, {unit}, {frame}   ±{uncertainty} (k=2)</source>
        <translation>Kugelmitte, {unit}, {frame}   ±{uncertainty} (k=2)</translation>
    </message>
    <message>
        <source>Residuals of the points from the fitted feature</source>
        <translation>Restabweichungen der Punkte vom eingepassten Element</translation>
    </message>
    <message>
        <source>Points from the fit</source>
        <translation>Punkte zur Einpassung</translation>
    </message>
    <message>
        <source>Simulated: not a real part</source>
        <translation>Simuliert: kein echtes Werkstück</translation>
    </message>
    <message>
        <source>cameras that see the probe / in the rig</source>
        <translation>Kameras, die den Taster sehen / im System</translation>
    </message>
    <message>
        <source>Targets</source>
        <translation>Ziele</translation>
    </message>
    <message>
        <source>LEDs that two cameras see / on the probe</source>
        <translation>LEDs, die zwei Kameras sehen / am Taster</translation>
    </message>
    <message>
        <source>Reference</source>
        <translation>Referenz</translation>
    </message>
    <message>
        <source>LEDs of the reference body that two cameras see / on it</source>
        <translation>LEDs des Referenzkörpers, die zwei Kameras sehen / an ihm</translation>
    </message>
    <message>
        <source>U point</source>
        <translation>U Punkt</translation>
    </message>
    <message>
        <source>expanded uncertainty of a point here, {unit}, k = 2</source>
        <translation>erweiterte Unsicherheit eines Punkts hier, {unit}, k = 2</translation>
    </message>
    <message>
        <source>Frames/s</source>
        <translation>Bilder/s</translation>
    </message>
    <message>
        <source>frames tracked per second</source>
        <translation>verfolgte Bilder je Sekunde</translation>
    </message>
    <message>
        <source>Good</source>
        <translation>Gut</translation>
    </message>
    <message>
        <source>bus cycles on time</source>
        <translation>pünktliche Buszyklen</translation>
    </message>
    <message>
        <source>Late</source>
        <translation>Spät</translation>
    </message>
    <message>
        <source>late bus cycles</source>
        <translation>verspätete Buszyklen</translation>
    </message>
    <message>
        <source>lost bus cycles</source>
        <translation>verlorene Buszyklen</translation>
    </message>
    <message>
        <source>rejected bus cycles</source>
        <translation>verworfene Buszyklen</translation>
    </message>
    <message>
        <source>frames dropped because reconstruction was too slow</source>
        <translation>Bilder verworfen, weil die Rekonstruktion zu langsam war</translation>
    </message>
    <message>
        <source>Reason for the status</source>
        <translation>Grund des Zustands</translation>
    </message>
    <message>
        <source>Distance to the next point</source>
        <translation>Entfernung zum nächsten Punkt</translation>
    </message>
    <message>
        <source>there</source>
        <translation>da</translation>
    </message>
    <message>
        <source>Probe and tip</source>
        <translation>Taster und Tastspitze</translation>
    </message>
    <message>
        <source>Tip {tip}: {word}</source>
        <translation>Tastspitze {tip}: {word}</translation>
    </message>
    <message>
        <source>Probe {probe}: {word}</source>
        <translation>Taster {probe}: {word}</translation>
    </message>
    <message>
        <source>ball {diameter_mm:.4f} mm</source>
        <translation>Kugel {diameter_mm:.4f} mm</translation>
    </message>
    <message>
        <source>Probe {title}: {word}, nominal geometry, {ball}.</source>
        <translation>Taster {title}: {word}, Nenngeometrie, {ball}.</translation>
    </message>
    <message>
        <source>No points: {blocker}</source>
        <translation>Keine Punkte: {blocker}</translation>
    </message>
    <message>
        <source>Probe {title}: {word}, {ball}.</source>
        <translation>Taster {title}: {word}, {ball}.</translation>
    </message>
    <message>
        <source>Probe {title}: {word} until {until}, {ball}.</source>
        <translation>Taster {title}: {word} bis {until}, {ball}.</translation>
    </message>
    <message>
        <source>UNCALIBRATED: no proof</source>
        <translation>UNKALIBRIERT: kein Nachweis</translation>
    </message>
    <message>
        <source>UNCALIBRATED: results are not proven. {why} {warnings}</source>
        <translation>UNKALIBRIERT: Ergebnisse sind nicht nachgewiesen. {why} {warnings}</translation>
    </message>
    <message>
        <source>NO POINTS: {blocker}</source>
        <translation>KEINE PUNKTE: {blocker}</translation>
    </message>
    <message>
        <source>no file yet</source>
        <translation>noch keine Datei</translation>
    </message>
    <message>
        <source>saved</source>
        <translation>gespeichert</translation>
    </message>
    <message>
        <source>not saved yet</source>
        <translation>noch nicht gespeichert</translation>
    </message>
    <message>
        <source>Names, separated by commas</source>
        <translation>Namen, durch Komma getrennt</translation>
    </message>
    <message>
        <source>Features</source>
        <translation>Elemente</translation>
    </message>
    <message>
        <source>Normal or axis, part frame: x y z</source>
        <translation>Normale oder Achse, Werkstücksystem: x y z</translation>
    </message>
    <message>
        <source>Diameter, mm</source>
        <translation>Durchmesser, mm</translation>
    </message>
    <message>
        <source>Round shapes only; else 0</source>
        <translation>Nur runde Formen; sonst 0</translation>
    </message>
    <message>
        <source>Length, mm</source>
        <translation>Länge, mm</translation>
    </message>
    <message>
        <source>Slots and rectangles; others if known, else 0</source>
        <translation>Nuten und Rechtecke; andere falls bekannt, sonst 0</translation>
    </message>
    <message>
        <source>Positive side</source>
        <translation>Positive Seite</translation>
    </message>
    <message>
        <source>Feature on the positive side; or empty</source>
        <translation>Element auf der positiven Seite; oder leer</translation>
    </message>
    <message>
        <source>Starts from</source>
        <translation>Beginnt mit</translation>
    </message>
    <message>
        <source>Initial alignment; or empty</source>
        <translation>Vorausrichtung; oder leer</translation>
    </message>
    <message>
        <source>How the part frame is found; empty: no alignment</source>
        <translation>Wie das Werkstücksystem bestimmt wird; leer: keine Ausrichtung</translation>
    </message>
    <message>
        <source>Covariance</source>
        <translation>Kovarianz</translation>
    </message>
    <message>
        <source>Of rotation and translation of the frame, rad and mm</source>
        <translation>Von Drehung und Verschiebung des Koordinatensystems, rad und mm</translation>
    </message>
    <message>
        <source>Simulated</source>
        <translation>Simuliert</translation>
    </message>
    <message>
        <source>Frame measured on a virtual rig</source>
        <translation>System an virtuellen Kameras gemessen</translation>
    </message>
    <message>
        <source>SHA-256</source>
        <translation>SHA-256</translation>
    </message>
    <message>
        <source>Hash of the frame document; Shift+F9 imports one</source>
        <translation>Hash des Systemdokuments; Umschalt+F9 importiert eines</translation>
    </message>
    <message>
        <source>E.g. 19 – 21; empty: no limit</source>
        <translation>z. B. 19 – 21; leer: keine Grenze</translation>
    </message>
    <message>
        <source>Air pressure, hPa</source>
        <translation>Luftdruck, hPa</translation>
    </message>
    <message>
        <source>Shape</source>
        <translation>Form</translation>
    </message>
    <message>
        <source>Features to probe</source>
        <translation>Anzutastende Elemente</translation>
    </message>
    <message>
        <source>Number of points</source>
        <translation>Anzahl Punkte</translation>
    </message>
    <message>
        <source>Probe side: outer for shafts and faces, inner for bores</source>
        <translation>Antastseite: außen bei Wellen und Flächen, innen bei Bohrungen</translation>
    </message>
    <message>
        <source>Point, mm</source>
        <translation>Punkt, mm</translation>
    </message>
    <message>
        <source>Centre or a point on it, part frame: x y z</source>
        <translation>Mitte oder ein Punkt darauf, Werkstücksystem: x y z</translation>
    </message>
    <message>
        <source>Width, mm</source>
        <translation>Breite, mm</translation>
    </message>
    <message>
        <source>Apex angle, °</source>
        <translation>Kegelwinkel, °</translation>
    </message>
    <message>
        <source>Cone: full angle; else 0</source>
        <translation>Kegel: voller Winkel; sonst 0</translation>
    </message>
    <message>
        <source>Along</source>
        <translation>Entlang</translation>
    </message>
    <message>
        <source>Direction of the length, part frame: x y z</source>
        <translation>Richtung der Länge, Werkstücksystem: x y z</translation>
    </message>
    <message>
        <source>Association</source>
        <translation>Zuordnung</translation>
    </message>
    <message>
        <source>Fit criterion</source>
        <translation>Kriterium der Einpassung</translation>
    </message>
    <message>
        <source>Projected on</source>
        <translation>Projiziert auf</translation>
    </message>
    <message>
        <source>Probe side by</source>
        <translation>Antastseite durch</translation>
    </message>
    <message>
        <source>Empty: as in the plan</source>
        <translation>Leer: wie im Plan</translation>
    </message>
    <message>
        <source>Path points, mm</source>
        <translation>Bahnpunkte, mm</translation>
    </message>
    <message>
        <source>Continuous probing: distance of the points; 0: single touches</source>
        <translation>Scannen: Abstand der Punkte; 0: Einzelantastungen</translation>
    </message>
    <message>
        <source>Scan</source>
        <translation>Scan</translation>
    </message>
    <message>
        <source>Continuous probing: way over the surface; empty: free</source>
        <translation>Scannen: Weg über die Fläche; leer: frei</translation>
    </message>
    <message>
        <source>Path by time, s</source>
        <translation>Bahn nach Zeit, s</translation>
    </message>
    <message>
        <source>Continuous probing: least time between points; else 0</source>
        <translation>Scannen: Mindestzeit zwischen Punkten; sonst 0</translation>
    </message>
    <message>
        <source>Path by turn, °</source>
        <translation>Bahn nach Drehung, °</translation>
    </message>
    <message>
        <source>Continuous probing: change of direction between points; else 0</source>
        <translation>Scannen: Richtungsänderung zwischen Punkten; sonst 0</translation>
    </message>
    <message>
        <source>Path by gates</source>
        <translation>Bahn nach Toren</translation>
    </message>
    <message>
        <source>Continuous probing: normal of the planes that give points; else 0 0 0</source>
        <translation>Scannen: Normale der Ebenen, die Punkte geben; sonst 0 0 0</translation>
    </message>
    <message>
        <source>Sheet, mm</source>
        <translation>Blech, mm</translation>
    </message>
    <message>
        <source>Thickness between the touched side and that of the plan; else 0</source>
        <translation>Dicke zwischen angetasteter Seite und der des Plans; sonst 0</translation>
    </message>
    <message>
        <source>Its limit, mm</source>
        <translation>Sein Grenzwert, mm</translation>
    </message>
    <message>
        <source>Largest deviation of the sheet; else 0</source>
        <translation>Größte Abweichung des Blechs; sonst 0</translation>
    </message>
    <message>
        <source>Targets, mm</source>
        <translation>Ziele, mm</translation>
    </message>
    <message>
        <source>Where to touch, from a model; empty: spread over the sizes</source>
        <translation>Wo anzutasten ist, aus einem Modell; leer: über die Maße verteilt</translation>
    </message>
    <message>
        <source>Instruction</source>
        <translation>Anweisung</translation>
    </message>
    <message>
        <source>Instruction shown at this step</source>
        <translation>Anweisung bei diesem Schritt</translation>
    </message>
    <message>
        <source>Picture</source>
        <translation>Bild</translation>
    </message>
    <message>
        <source>Picture file beside the plan; Shift+F7 attaches one</source>
        <translation>Bilddatei neben dem Plan; Umschalt+F7 fügt eine an</translation>
    </message>
    <message>
        <source>Fitted in space</source>
        <translation>Räumlich eingepasst</translation>
    </message>
    <message>
        <source>Circle fitted in space at once, not plane first</source>
        <translation>Kreis sofort räumlich eingepasst, nicht zuerst die Ebene</translation>
    </message>
    <message>
        <source>Toleranced features</source>
        <translation>Tolerierte Elemente</translation>
    </message>
    <message>
        <source>Datums</source>
        <translation>Bezüge</translation>
    </message>
    <message>
        <source>Names by precedence, with commas; or empty</source>
        <translation>Namen nach Rang, mit Kommas; oder leer</translation>
    </message>
    <message>
        <source>mm, or degrees for angles; 0 for zones</source>
        <translation>mm, bei Winkeln Grad; 0 bei Zonen</translation>
    </message>
    <message>
        <source>Lower limit</source>
        <translation>Unteres Grenzabmaß</translation>
    </message>
    <message>
        <source>Of the deviation; 0 for zones</source>
        <translation>Der Abweichung; 0 bei Zonen</translation>
    </message>
    <message>
        <source>Upper limit</source>
        <translation>Oberes Grenzabmaß</translation>
    </message>
    <message>
        <source>Of the deviation; the tolerance of a zone</source>
        <translation>Der Abweichung; bei Zonen die Toleranz</translation>
    </message>
    <message>
        <source>Axis</source>
        <translation>Achse</translation>
    </message>
    <message>
        <source>Of coordinates and distances</source>
        <translation>Von Koordinaten und Abständen</translation>
    </message>
    <message>
        <source>Empty: default of the kind</source>
        <translation>Leer: Standard der Art</translation>
    </message>
    <message>
        <source>Zone</source>
        <translation>Zone</translation>
    </message>
    <message>
        <source>Position and orientation; empty: default</source>
        <translation>Position und Richtung; leer: Standard</translation>
    </message>
    <message>
        <source>Modifier</source>
        <translation>Bedingung</translation>
    </message>
    <message>
        <source>Bonus: departure of the size from its limit</source>
        <translation>Bonus: Abstand des Maßes von seiner Grenze</translation>
    </message>
    <message>
        <source>Limit size, mm</source>
        <translation>Grenzmaß, mm</translation>
    </message>
    <message>
        <source>Limit the modifier refers to; else 0</source>
        <translation>Grenze, auf die sich die Bedingung bezieht; sonst 0</translation>
    </message>
    <message>
        <source>Toleranced length of an axis; 0: probed length</source>
        <translation>Tolerierte Länge einer Achse; 0: angetastete Länge</translation>
    </message>
    <message>
        <source>Offset, mm</source>
        <translation>Versatz, mm</translation>
    </message>
    <message>
        <source>Offset of a profile zone; else 0</source>
        <translation>Versatz einer Profilzone; sonst 0</translation>
    </message>
    <message>
        <source>At, mm</source>
        <translation>In Höhe, mm</translation>
    </message>
    <message>
        <source>Cone: height of the diameter; else 0</source>
        <translation>Kegel: Höhe des Durchmessers; sonst 0</translation>
    </message>
    <message>
        <source>Section</source>
        <translation>Schnitt</translation>
    </message>
    <message>
        <source>Profile of a line: normal of the plane that cuts the features; else 0 0 0</source>
        <translation>Linienprofil: Normale der Ebene, die die Elemente schneidet; sonst 0 0 0</translation>
    </message>
    <message>
        <source>Section at, mm</source>
        <translation>Schnitt bei, mm</translation>
    </message>
    <message>
        <source>A point of that plane, part frame: x y z</source>
        <translation>Ein Punkt dieser Ebene, Werkstücksystem: x y z</translation>
    </message>
    <message>
        <source>Section width, mm</source>
        <translation>Schnittbreite, mm</translation>
    </message>
    <message>
        <source>Largest distance of points from the plane</source>
        <translation>Größter Abstand der Punkte von der Ebene</translation>
    </message>
    <message>
        <source>Faces</source>
        <translation>Flächen</translation>
    </message>
    <message>
        <source>Plan name, used for file names</source>
        <translation>Name des Plans, auch für Dateinamen</translation>
    </message>
    <message>
        <source>Name of the part</source>
        <translation>Name des Werkstücks</translation>
    </message>
    <message>
        <source>Decision rule</source>
        <translation>Entscheidungsregel</translation>
    </message>
    <message>
        <source>How the probe side is found</source>
        <translation>Wie die Antastseite bestimmt wird</translation>
    </message>
    <message>
        <source>unproven: also such that cannot prove the age of their data</source>
        <translation>ohne Nachweis: auch solche, die das Alter ihrer Daten nicht belegen</translation>
    </message>
    <message>
        <source>Room</source>
        <translation>Raum</translation>
    </message>
    <message>
        <source>Material</source>
        <translation>Werkstoff</translation>
    </message>
    <message>
        <source>Needed to report results at 20 °C; or empty</source>
        <translation>Für Ergebnisse bei 20 °C nötig; oder leer</translation>
    </message>
    <message>
        <source>Of the material</source>
        <translation>Des Werkstoffs</translation>
    </message>
    <message>
        <source>Expansion</source>
        <translation>Ausdehnung</translation>
    </message>
    <message>
        <source>1e-6/K; steel 11.5, aluminium 23.1</source>
        <translation>1e-6/K; Stahl 11.5, Aluminium 23.1</translation>
    </message>
    <message>
        <source>Its uncertainty</source>
        <translation>Ihre Unsicherheit</translation>
    </message>
    <message>
        <source>Standard uncertainty, 1e-6/K; handbook value: 1</source>
        <translation>Standardunsicherheit, 1e-6/K; Tabellenwert: 1</translation>
    </message>
    <message>
        <source>Construction</source>
        <translation>Konstruktion</translation>
    </message>
    <message>
        <source>The gauge in the thread; the face of the hole</source>
        <translation>Die Lehre im Gewinde; die Fläche der Bohrung</translation>
    </message>
    <message>
        <source>Play, mm</source>
        <translation>Spiel, mm</translation>
    </message>
    <message>
        <source>Largest distance of the axes of gauge and thread</source>
        <translation>Größter Abstand der Achsen von Lehre und Gewinde</translation>
    </message>
    <message>
        <source>Engaged, mm</source>
        <translation>Einschraublänge, mm</translation>
    </message>
    <message>
        <source>Length of the gauge in the thread; 0: no tilt</source>
        <translation>Länge der Lehre im Gewinde; 0: ohne Neigung</translation>
    </message>
    <message>
        <source>Surface, axis, centre; middle of a line</source>
        <translation>Oberfläche, Achse, Mitte; Mitte einer Geraden</translation>
    </message>
    <message>
        <source>ring</source>
        <translation>Ring</translation>
    </message>
    <message>
        <source>spiral</source>
        <translation>Spirale</translation>
    </message>
    <message>
        <source>raster</source>
        <translation>parallele Linien</translation>
    </message>
    <message>
        <source>Letters, digits, spaces, _ . - /</source>
        <translation>Buchstaben, Ziffern, Leerzeichen, _ . - /</translation>
    </message>
    <message>
        <source>Slots, rectangles, tube of a torus; edge: sheet</source>
        <translation>Nuten, Rechtecke, Rohr eines Torus; Kante: Blech</translation>
    </message>
    <message>
        <source>Plane of circles and slots, face of an edge; or empty</source>
        <translation>Ebene von Kreisen und Nuten, Fläche einer Kante; oder leer</translation>
    </message>
    <message>
        <source>proposed: not yet set; change or confirm them</source>
        <translation>vorgeschlagen: noch nicht gesetzt; ändern oder bestätigen</translation>
    </message>
    <message>
        <source>Of the model, for a profile: what points are held against</source>
        <translation>Des Modells, für ein Profil: womit Punkte verglichen werden</translation>
    </message>
    <message>
        <source>Constructed features</source>
        <translation>Konstruierte Elemente</translation>
    </message>
    <message>
        <source>Two planes; plane and axis; three planes; two axes</source>
        <translation>Zwei Ebenen; Ebene und Achse; drei Ebenen; zwei Achsen</translation>
    </message>
    <message>
        <source>Feature to project; plane or axis to project onto</source>
        <translation>Zu projizierendes Element; Ebene oder Achse als Ziel</translation>
    </message>
    <message>
        <source>Two points or centres</source>
        <translation>Zwei Punkte oder Mitten</translation>
    </message>
    <message>
        <source>Two planes, or two lines or axes</source>
        <translation>Zwei Ebenen, oder zwei Geraden oder Achsen</translation>
    </message>
    <message>
        <source>Which</source>
        <translation>Welche</translation>
    </message>
    <message>
        <source>between: midway between two faces; across: square to it</source>
        <translation>dazwischen: mittig zwischen zwei Flächen; quer: quer dazu</translation>
    </message>
    <message>
        <source>Pairs of centres in turn, or two faces</source>
        <translation>Paare von Mitten der Reihe nach, oder zwei Flächen</translation>
    </message>
    <message>
        <source>Feature to move, and direction; one alone: its own</source>
        <translation>Zu verschiebendes Element und Richtung; allein: seine eigene</translation>
    </message>
    <message>
        <source>Distance, mm</source>
        <translation>Abstand, mm</translation>
    </message>
    <message>
        <source>Negative: opposite direction</source>
        <translation>Negativ: Gegenrichtung</translation>
    </message>
    <message>
        <source>Three centres or more; or features with points</source>
        <translation>Drei oder mehr Mitten; oder Elemente mit Punkten</translation>
    </message>
    <message>
        <source>Of the element</source>
        <translation>Des Elements</translation>
    </message>
    <message>
        <source>Through</source>
        <translation>Durch</translation>
    </message>
    <message>
        <source>Centres, or all probed points</source>
        <translation>Mitten, oder alle Messpunkte</translation>
    </message>
    <message>
        <source>Plane near which points count; or empty</source>
        <translation>Ebene, in deren Nähe Punkte zählen; oder leer</translation>
    </message>
    <message>
        <source>Three holes or more</source>
        <translation>Drei oder mehr Bohrungen</translation>
    </message>
    <message>
        <source>A cone; or a cone and a plane</source>
        <translation>Ein Kegel; oder Kegel und Ebene</translation>
    </message>
    <message>
        <source>Of the gauge circle; 0 with a plane</source>
        <translation>Des Prüfkreises; 0 bei einer Ebene</translation>
    </message>
    <message>
        <source>From the plane, along its normal; else 0</source>
        <translation>Von der Ebene, entlang ihrer Normale; sonst 0</translation>
    </message>
    <message>
        <source>The two balls: the farther first, the nearer second</source>
        <translation>Die zwei Kugeln: die fernere zuerst, dann die nähere</translation>
    </message>
    <message>
        <source>From the second centre, as certified</source>
        <translation>Von der zweiten Mitte, wie zertifiziert</translation>
    </message>
    <message>
        <source>One</source>
        <translation>Eines</translation>
    </message>
    <message>
        <source>Primary</source>
        <translation>Primär</translation>
    </message>
    <message>
        <source>Plane whose normal, or axis, is z of the part</source>
        <translation>Ebene, deren Normale z des Werkstücks ist, oder Achse</translation>
    </message>
    <message>
        <source>Secondary</source>
        <translation>Sekundär</translation>
    </message>
    <message>
        <source>Two centres separated by a comma, or one line: x</source>
        <translation>Zwei Mitten, durch Komma getrennt, oder eine Gerade: x</translation>
    </message>
    <message>
        <source>Origin</source>
        <translation>Ursprung</translation>
    </message>
    <message>
        <source>Feature whose centre is the origin</source>
        <translation>Element, dessen Mitte der Ursprung ist</translation>
    </message>
    <message>
        <source>Primary gives</source>
        <translation>Primär ergibt</translation>
    </message>
    <message>
        <source>Axis of the part</source>
        <translation>Achse des Werkstücks</translation>
    </message>
    <message>
        <source>Secondary gives</source>
        <translation>Sekundär ergibt</translation>
    </message>
    <message>
        <source>outer</source>
        <translation>außen</translation>
    </message>
    <message>
        <source>inner</source>
        <translation>innen</translation>
    </message>
    <message>
        <source>approach</source>
        <translation>Antastrichtung</translation>
    </message>
    <message>
        <source>pulled</source>
        <translation>abheben</translation>
    </message>
    <message>
        <source>shank</source>
        <translation>Schaft</translation>
    </message>
    <message>
        <source>nominal</source>
        <translation>Nennnormale</translation>
    </message>
    <message>
        <source>proven</source>
        <translation>mit Nachweis</translation>
    </message>
    <message>
        <source>unproven</source>
        <translation>ohne Nachweis</translation>
    </message>
    <message>
        <source>between</source>
        <translation>dazwischen</translation>
    </message>
    <message>
        <source>centres</source>
        <translation>Mittelpunkte</translation>
    </message>
    <message>
        <source>planes</source>
        <translation>Ebenen</translation>
    </message>
    <message>
        <source>intersection</source>
        <translation>Schnitt</translation>
    </message>
    <message>
        <source>projection</source>
        <translation>Projektion</translation>
    </message>
    <message>
        <source>middle</source>
        <translation>Mitte</translation>
    </message>
    <message>
        <source>midpoint</source>
        <translation>Mittelpunkt</translation>
    </message>
    <message>
        <source>bisector</source>
        <translation>Symmetrale</translation>
    </message>
    <message>
        <source>offset</source>
        <translation>Versatz</translation>
    </message>
    <message>
        <source>plane-axis-point</source>
        <translation>Ebene-Achse-Punkt</translation>
    </message>
    <message>
        <source>given</source>
        <translation>gegeben</translation>
    </message>
    <message>
        <source>yes</source>
        <translation>ja</translation>
    </message>
    <message>
        <source>no</source>
        <translation>nein</translation>
    </message>
    <message>
        <source>set</source>
        <translation>gesetzt</translation>
    </message>
    <message>
        <source>proposed</source>
        <translation>vorgeschlagen</translation>
    </message>
    <message>
        <source>Faces to align by</source>
        <translation>Flächen zum Ausrichten</translation>
    </message>
    <message>
        <source>Faces of the model</source>
        <translation>Flächen des Modells</translation>
    </message>
    <message>
        <source>Align by these  [Return]</source>
        <translation>Danach ausrichten  [Eingabe]</translation>
    </message>
    <message>
        <source>Align the part by a best fit to the chosen faces</source>
        <translation>Werkstück durch Bestpassung an die gewählten Flächen ausrichten</translation>
    </message>
    <message>
        <source>Go back without faces</source>
        <translation>Zurück ohne Flächen</translation>
    </message>
    <message>
        <source>The selected face</source>
        <translation>Die markierte Fläche</translation>
    </message>
    <message>
        <source>The model has no face with an exact surface.</source>
        <translation>Das Modell hat keine Fläche mit exakter Form.</translation>
    </message>
    <message>
        <source>Choose faces that leave no motion of the part open.</source>
        <translation>Flächen wählen, die keine Bewegung des Werkstücks offen lassen.</translation>
    </message>
    <message numerus="yes">
        <source>%n of {all} faces are chosen.</source>
        <comment>1 of {all} faces is chosen.</comment>
        <translation>
            <numerusform>%n von {all} Flächen ist gewählt.</numerusform>
            <numerusform>%n von {all} Flächen sind gewählt.</numerusform>
        </translation>
    </message>
    <message>
        <source>face {number}</source>
        <translation>Fläche {number}</translation>
    </message>
    <message>
        <source>Plane</source>
        <translation>Ebene</translation>
    </message>
    <message>
        <source>Cylinder</source>
        <translation>Zylinder</translation>
    </message>
    <message>
        <source>Torus</source>
        <translation>Torus</translation>
    </message>
    <message>
        <source>Aligned to its nominal first</source>
        <translation>Zuerst auf ihr Nennmaß ausgerichtet</translation>
    </message>
    <message>
        <source>Second: line, axis or normal</source>
        <translation>Zweite: Gerade, Achse oder Normale</translation>
    </message>
    <message>
        <source>Point</source>
        <translation>Punkt</translation>
    </message>
    <message>
        <source>Third: a centre</source>
        <translation>Dritter: eine Mitte</translation>
    </message>
    <message>
        <source>One to three, in order of precedence</source>
        <translation>Eins bis drei, in ihrer Rangfolge</translation>
    </message>
    <message>
        <source>Three or more features with centres</source>
        <translation>Drei oder mehr Elemente mit Mitten</translation>
    </message>
    <message>
        <source>Weights</source>
        <translation>Gewichte</translation>
    </message>
    <message>
        <source>One number per point; empty: equal weights</source>
        <translation>Eine Zahl je Punkt; leer: gleiche Gewichte</translation>
    </message>
    <message>
        <source>Locked</source>
        <translation>Gesperrt</translation>
    </message>
    <message>
        <source>Of x, y, z, rx, ry, rz, separated by commas</source>
        <translation>Von x, y, z, rx, ry, rz, durch Komma getrennt</translation>
    </message>
    <message>
        <source>Seven or more single points on the faces</source>
        <translation>Sieben oder mehr Einzelpunkte auf den Flächen</translation>
    </message>
    <message>
        <source>Of the model; they come with an import</source>
        <translation>Des Modells; sie kommen mit einem Import</translation>
    </message>
    <message>
        <source>Six conditions</source>
        <translation>Sechs Bedingungen</translation>
    </message>
    <message>
        <source>One per line: feature, then direction x y z</source>
        <translation>Eine je Zeile: Element, dann Richtung x y z</translation>
    </message>
    <message>
        <source>Rotation</source>
        <translation>Drehung</translation>
    </message>
    <message>
        <source>From the world to the frame, row by row</source>
        <translation>Von der Welt zum System, Zeile für Zeile</translation>
    </message>
    <message>
        <source>Translation, mm</source>
        <translation>Verschiebung, mm</translation>
    </message>
    <message>
        <source>In the frame</source>
        <translation>Im System</translation>
    </message>
    <message>
        <source>Control points</source>
        <translation>Kontrollpunkte</translation>
    </message>
    <message>
        <source>Feature and its position in the frame, mm</source>
        <translation>Element und seine Position im System, mm</translation>
    </message>
    <message>
        <source>Limit, mm</source>
        <translation>Grenze, mm</translation>
    </message>
    <message>
        <source>A control point off by more than this has moved</source>
        <translation>Ein Kontrollpunkt, der weiter abliegt, hat sich bewegt</translation>
    </message>
    <message numerus="yes">
        <source>%n free-form faces added.</source>
        <comment>1 free-form face added.</comment>
        <translation>
            <numerusform>%n Freiformfläche angefügt.</numerusform>
            <numerusform>%n Freiformflächen angefügt.</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n features added from {name}.</source>
        <comment>1 feature added from {name}.</comment>
        <translation>
            <numerusform>%n Element aus {name} angefügt.</numerusform>
            <numerusform>%n Elemente aus {name} angefügt.</numerusform>
        </translation>
    </message>
    <message>
        <source>CAD models (STEP) need an extra of some {size} MB: {command}.</source>
        <translation>CAD-Modelle (STEP) brauchen einen Zusatz von etwa {size} MB: {command}.</translation>
    </message>
    <message>
        <source>The frame {name} is used as saved.</source>
        <translation>Das System {name} wird wie gespeichert genutzt.</translation>
    </message>
    <message>
        <source>The frame {name} will be relocated at its control points.</source>
        <translation>Das System {name} wird an seinen Kontrollpunkten neu bestimmt.</translation>
    </message>
    <message>
        <source>Importing</source>
        <translation>Wird importiert</translation>
    </message>
    <message>
        <source>Importing {name}.</source>
        <translation>{name} wird importiert.</translation>
    </message>
    <message>
        <source>Shift+F9 cancels.</source>
        <translation>Umschalt+F9 bricht ab.</translation>
    </message>
    <message>
        <source>Reading the model of the plan.</source>
        <translation>Modell des Prüfplans wird gelesen.</translation>
    </message>
    <message>
        <source>Importing: {what}.</source>
        <translation>Import: {what}.</translation>
    </message>
    <message>
        <source>Features of the model</source>
        <translation>Elemente des Modells</translation>
    </message>
    <message>
        <source>What is chosen</source>
        <translation>Was gewählt ist</translation>
    </message>
    <message>
        <source>Why the selected surface is not chosen</source>
        <translation>Warum die ausgewählte Fläche nicht gewählt ist</translation>
    </message>
    <message>
        <source>Axis that points up</source>
        <translation>Achse, die nach oben zeigt</translation>
    </message>
    <message>
        <source>How the part stands</source>
        <translation>Wie das Werkstück steht</translation>
    </message>
    <message>
        <source>Profile of free forms, {unit}</source>
        <translation>Profil der Freiformen, {unit}</translation>
    </message>
    <message>
        <source>Width of the zone</source>
        <translation>Breite der Zone</translation>
    </message>
    <message>
        <source>Take over  [Return]</source>
        <translation>Übernehmen  [Eingabe]</translation>
    </message>
    <message>
        <source>Take the chosen surfaces over as features</source>
        <translation>Gewählte Flächen als Elemente übernehmen</translation>
    </message>
    <message>
        <source>Go back without features</source>
        <translation>Zurück ohne Elemente</translation>
    </message>
    <message>
        <source>Enter the profile of free forms.</source>
        <translation>Profil der Freiformen eingeben.</translation>
    </message>
    <message>
        <source>{name} can be touched.</source>
        <translation>{name} kann angetastet werden.</translation>
    </message>
    <message>
        <source>{name}: points and their profile against the model.</source>
        <translation>{name}: Punkte und ihr Profil zum Modell.</translation>
    </message>
    <message numerus="yes">
        <source>%n of {all} surfaces are chosen.</source>
        <comment>1 of {all} surfaces is chosen.</comment>
        <translation>
            <numerusform>%n von {all} Flächen ist gewählt.</numerusform>
            <numerusform>%n von {all} Flächen sind gewählt.</numerusform>
        </translation>
    </message>
    <message>
        <source>{name}: {why}.</source>
        <translation>{name}: {why}.</translation>
    </message>
    <message>
        <source>Up</source>
        <translation>Oben</translation>
    </message>
    <message>
        <source>Surfaces of the model</source>
        <translation>Flächen des Modells</translation>
    </message>
    <message>
        <source>Space chooses, Return takes over, Esc goes back</source>
        <translation>Leertaste wählt, Eingabe übernimmt, Esc geht zurück</translation>
    </message>
    <message>
        <source>Free form</source>
        <translation>Freiform</translation>
    </message>
    <message>
        <source>Checks</source>
        <translation>Prüfungen</translation>
    </message>
    <message>
        <source>✖  Not applied: {what} {remedy}</source>
        <translation>✖  Nicht übernommen: {what} {remedy}</translation>
    </message>
    <message>
        <source>✔  The plan is valid and can be measured.</source>
        <translation>✔  Der Plan ist gültig und kann gemessen werden.</translation>
    </message>
    <message>
        <source>▲  The plan can be measured. {doubts}</source>
        <translation>▲  Der Plan kann gemessen werden. {doubts}</translation>
    </message>
    <message>
        <source>✖  The plan is not valid: no job can be started by it. {errors}</source>
        <translation>✖  Der Prüfplan ist nicht gültig: Mit ihm lässt sich kein Auftrag beginnen. {errors}</translation>
    </message>
    <message>
        <source>Picture of {names} not found beside the plan: the feature is drawn instead.</source>
        <translation>Bild von {names} liegt nicht neben dem Plan: stattdessen wird das Element gezeichnet.</translation>
    </message>
    <message>
        <source>Items of the plan</source>
        <translation>Einträge des Plans</translation>
    </message>
    <message>
        <source>Up and down select an item</source>
        <translation>Auf und Ab wählen einen Eintrag</translation>
    </message>
    <message>
        <source>Plan {name}</source>
        <translation>Plan {name}</translation>
    </message>
    <message>
        <source>Alignment   {rule}</source>
        <translation>Ausrichtung   {rule}</translation>
    </message>
    <message numerus="yes">
        <source>%n points</source>
        <comment>1 point</comment>
        <translation>
            <numerusform>%n Punkt</numerusform>
            <numerusform>%n Punkte</numerusform>
        </translation>
    </message>
    <message>
        <source>Add a feature after the selected one</source>
        <translation>Element nach dem ausgewählten anfügen</translation>
    </message>
    <message>
        <source>Construct</source>
        <translation>Konstruieren</translation>
    </message>
    <message>
        <source>Add a construction from the selected feature</source>
        <translation>Konstruktion aus dem ausgewählten Element anfügen</translation>
    </message>
    <message>
        <source>Tolerance</source>
        <translation>Toleranz</translation>
    </message>
    <message>
        <source>Add a characteristic of the selected feature</source>
        <translation>Merkmal des ausgewählten Elements anfügen</translation>
    </message>
    <message>
        <source>Define the part alignment</source>
        <translation>Ausrichtung des Werkstücks festlegen</translation>
    </message>
    <message>
        <source>Align by a best fit to faces of the model</source>
        <translation>Durch Bestpassung an Flächen des Modells ausrichten</translation>
    </message>
    <message>
        <source>Remove the selected item</source>
        <translation>Ausgewählten Eintrag entfernen</translation>
    </message>
    <message>
        <source>Earlier</source>
        <translation>Früher</translation>
    </message>
    <message>
        <source>Move the selected item up</source>
        <translation>Ausgewählten Eintrag nach oben schieben</translation>
    </message>
    <message>
        <source>Later</source>
        <translation>Später</translation>
    </message>
    <message>
        <source>Move the selected item down</source>
        <translation>Ausgewählten Eintrag nach unten schieben</translation>
    </message>
    <message>
        <source>Undo the last change</source>
        <translation>Letzte Änderung zurücknehmen</translation>
    </message>
    <message>
        <source>Redo the last undone change</source>
        <translation>Zurückgenommene Änderung wiederherstellen</translation>
    </message>
    <message>
        <source>Attach a picture to the selected feature</source>
        <translation>Dem ausgewählten Element ein Bild anfügen</translation>
    </message>
    <message>
        <source>Teach</source>
        <translation>Anlernen</translation>
    </message>
    <message>
        <source>Take the nominals from the current part</source>
        <translation>Nennmaße vom laufenden Werkstück übernehmen</translation>
    </message>
    <message>
        <source>Requirements written to {path}.</source>
        <translation>Anforderungen geschrieben nach {path}.</translation>
    </message>
    <message>
        <source>Import</source>
        <translation>Import</translation>
    </message>
    <message>
        <source>Import features from CSV or STEP, or a frame document for the alignment</source>
        <translation>Elemente aus CSV oder STEP, oder ein Systemdokument für die Ausrichtung importieren</translation>
    </message>
    <message>
        <source>Start a new plan</source>
        <translation>Neuen Plan beginnen</translation>
    </message>
    <message>
        <source>Open another plan file</source>
        <translation>Andere Plandatei öffnen</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Write the plan to a file</source>
        <translation>Plan in eine Datei schreiben</translation>
    </message>
    <message>
        <source>Requirements</source>
        <translation>Anforderungen</translation>
    </message>
    <message>
        <source>Write the inspection plan: all requirements with balloon numbers</source>
        <translation>Prüfliste schreiben: alle Anforderungen mit Positionsnummern</translation>
    </message>
    <message>
        <source>Measure</source>
        <translation>Messen</translation>
    </message>
    <message>
        <source>Start a job with this plan</source>
        <translation>Auftrag mit diesem Plan beginnen</translation>
    </message>
    <message>
        <source>Plan settings</source>
        <translation>Einstellungen des Plans</translation>
    </message>
    <message>
        <source>Write the plan into the file</source>
        <translation>Plan in die Datei schreiben</translation>
    </message>
    <message>
        <source>Import the features or frame from the file</source>
        <translation>Elemente oder System aus Datei importieren</translation>
    </message>
    <message>
        <source>File of the features or frame</source>
        <translation>Datei der Elemente oder des Systems</translation>
    </message>
    <message>
        <source>Attach the picture from the file</source>
        <translation>Bild aus Datei anfügen</translation>
    </message>
    <message>
        <source>File of the picture</source>
        <translation>Datei des Bilds</translation>
    </message>
    <message>
        <source>Attach</source>
        <translation>Anfügen</translation>
    </message>
    <message>
        <source>Open the plan from the file</source>
        <translation>Plan aus Datei öffnen</translation>
    </message>
    <message>
        <source>Write all requirements into the file (.xlsx, .csv)</source>
        <translation>Alle Anforderungen in die Datei schreiben (.xlsx, .csv)</translation>
    </message>
    <message>
        <source>File of the inspection plan</source>
        <translation>Datei der Prüfliste</translation>
    </message>
    <message>
        <source>Add the features to construct from first.</source>
        <translation>Zuerst die Elemente anfügen, aus denen konstruiert wird.</translation>
    </message>
    <message>
        <source>Select the feature to tolerance first.</source>
        <translation>Zuerst das zu tolerierende Element wählen.</translation>
    </message>
    <message>
        <source>No CAD model in this plan. Save it (F8), import one (Shift+F9).</source>
        <translation>Kein CAD-Modell in diesem Plan. Speichern (F8), dann eines importieren (Umschalt+F9).</translation>
    </message>
    <message numerus="yes">
        <source>Aligned by %n faces; {count} points added. F10 undoes this.</source>
        <comment>Aligned by 1 face; {count} points added. F10 undoes this.</comment>
        <translation>
            <numerusform>An %n Fläche ausgerichtet; {count} Punkte angefügt. F10 nimmt das zurück.</numerusform>
            <numerusform>An %n Flächen ausgerichtet; {count} Punkte angefügt. F10 nimmt das zurück.</numerusform>
        </translation>
    </message>
    <message>
        <source>Nothing to undo.</source>
        <translation>Nichts zurückzunehmen.</translation>
    </message>
    <message>
        <source>Nothing to redo.</source>
        <translation>Nichts wiederherzustellen.</translation>
    </message>
    <message>
        <source>Nothing was imported.</source>
        <translation>Nichts wurde importiert.</translation>
    </message>
    <message>
        <source>Save the plan first (F8): a job starts from its file.</source>
        <translation>Plan zuerst speichern (F8): ein Auftrag beginnt aus seiner Datei.</translation>
    </message>
    <message>
        <source>This plan has unsaved changes: save it (F8) or undo them.</source>
        <translation>Dieser Plan hat ungespeicherte Änderungen: speichern (F8) oder zurücknehmen.</translation>
    </message>
    <message>
        <source>The nominals now match the part.</source>
        <translation>Die Nennmaße entsprechen jetzt dem Werkstück.</translation>
    </message>
    <message>
        <source>Nothing has changed.</source>
        <translation>Nichts hat sich geändert.</translation>
    </message>
    <message>
        <source>{what} F10 undoes this.</source>
        <translation>{what} F10 nimmt das zurück.</translation>
    </message>
    <message>
        <source>PLAN</source>
        <translation>PLAN</translation>
    </message>
    <message>
        <source>PART</source>
        <translation>WERKSTÜCK</translation>
    </message>
    <message>
        <source>FEATURE</source>
        <translation>ELEMENT</translation>
    </message>
    <message>
        <source>CONSTRUCTION</source>
        <translation>KONSTRUKTION</translation>
    </message>
    <message>
        <source>Progress of teaching</source>
        <translation>Fortschritt des Anlernens</translation>
    </message>
    <message>
        <source>Reading the job</source>
        <translation>Auftrag wird gelesen</translation>
    </message>
    <message>
        <source>Rounding the nominals</source>
        <translation>Nennmaße werden gerundet</translation>
    </message>
    <message>
        <source>✔ taken</source>
        <translation>✔ übernommen</translation>
    </message>
    <message>
        <source>▲ in part</source>
        <translation>▲ teilweise</translation>
    </message>
    <message>
        <source>✖ refused</source>
        <translation>✖ abgelehnt</translation>
    </message>
    <message>
        <source>dimensions</source>
        <translation>Maße</translation>
    </message>
    <message>
        <source>tolerances</source>
        <translation>Toleranzen</translation>
    </message>
    <message>
        <source>datum references</source>
        <translation>Bezugsangaben</translation>
    </message>
    <message>
        <source>datums</source>
        <translation>Bezüge</translation>
    </message>
    <message>
        <source>datum targets</source>
        <translation>Bezugsstellen</translation>
    </message>
    <message>
        <source>labels and notes</source>
        <translation>Beschriftungen und Notizen</translation>
    </message>
    <message>
        <source>others</source>
        <translation>weitere</translation>
    </message>
    <message>
        <source>Tolerances of the model</source>
        <translation>Toleranzen des Modells</translation>
    </message>
    <message>
        <source>What became of the tolerances of the model</source>
        <translation>Was aus den Toleranzen des Modells wurde</translation>
    </message>
    <message>
        <source>Every item of the model</source>
        <translation>Jeder Eintrag des Modells</translation>
    </message>
    <message>
        <source>Whether it is in the plan</source>
        <translation>Ob er im Plan ist</translation>
    </message>
    <message>
        <source>Label</source>
        <translation>Bezeichnung</translation>
    </message>
    <message>
        <source>Its name in the model</source>
        <translation>Sein Name im Modell</translation>
    </message>
    <message>
        <source>Says</source>
        <translation>Angabe</translation>
    </message>
    <message>
        <source>What the model says</source>
        <translation>Was das Modell angibt</translation>
    </message>
    <message>
        <source>In the plan, or why not</source>
        <translation>Im Plan, oder warum nicht</translation>
    </message>
    <message>
        <source>Characteristics, datums, or the reason</source>
        <translation>Merkmale, Bezüge oder der Grund</translation>
    </message>
    <message>
        <source>Take over the tolerances</source>
        <translation>Toleranzen übernehmen</translation>
    </message>
    <message numerus="yes">
        <source>%n characteristics will be added.</source>
        <comment>1 characteristic will be added.</comment>
        <translation>
            <numerusform>%n Merkmal wird angefügt.</numerusform>
            <numerusform>%n Merkmale werden angefügt.</numerusform>
        </translation>
    </message>
    <message>
        <source>Take over</source>
        <translation>Übernehmen</translation>
    </message>
    <message>
        <source>Features only</source>
        <translation>Nur Elemente</translation>
    </message>
    <message>
        <source>Take over the features without tolerances</source>
        <translation>Elemente ohne Toleranzen übernehmen</translation>
    </message>
    <message>
        <source>{taken} of {count} {group}</source>
        <translation>{taken} von {count} {group}</translation>
    </message>
    <message>
        <source>Taken as a whole: {counts}.</source>
        <translation>Als Ganzes übernommen: {counts}.</translation>
    </message>
    <message>
        <source>Drawing the PDF</source>
        <translation>PDF wird gezeichnet</translation>
    </message>
    <message>
        <source>Writing and verifying the files</source>
        <translation>Dateien werden geschrieben und verifiziert</translation>
    </message>
    <message>
        <source>Recalculate</source>
        <translation>Neu berechnen</translation>
    </message>
    <message>
        <source>With the points taken so far</source>
        <translation>Mit den bisherigen Punkten</translation>
    </message>
    <message>
        <source>Accept</source>
        <translation>Annehmen</translation>
    </message>
    <message>
        <source>Record in the job that this alignment was accepted</source>
        <translation>Annahme dieser Ausrichtung im Auftrag vermerken</translation>
    </message>
    <message>
        <source>in brackets: not used for the frame, only checks it</source>
        <translation>in Klammern: nicht für das System genutzt, prüft es nur</translation>
    </message>
    <message>
        <source>off</source>
        <translation>Abstand</translation>
    </message>
    <message>
        <source>{unit}, deviation from nominal, in the frame</source>
        <translation>{unit}, Abweichung vom Nennmaß, im System</translation>
    </message>
    <message>
        <source>{unit}, length of the deviation vector</source>
        <translation>{unit}, Länge des Abweichungsvektors</translation>
    </message>
    <message>
        <source>{unit}, U of the distance, in its least certain direction</source>
        <translation>{unit}, U des Abstands in seiner unsichersten Richtung</translation>
    </message>
    <message>
        <source>turned, °</source>
        <translation>gedreht, °</translation>
    </message>
    <message>
        <source>angular deviation</source>
        <translation>Winkelabweichung</translation>
    </message>
    <message>
        <source>Degrees of freedom</source>
        <translation>Freiheitsgrade</translation>
    </message>
    <message>
        <source>Notes</source>
        <translation>Hinweise</translation>
    </message>
    <message>
        <source>Uncertainty of the frame</source>
        <translation>Unsicherheit des Systems</translation>
    </message>
    <message>
        <source>Progress of the calculation</source>
        <translation>Fortschritt der Berechnung</translation>
    </message>
    <message>
        <source>No alignment to accept yet.</source>
        <translation>Noch keine Ausrichtung zum Annehmen.</translation>
    </message>
    <message>
        <source>The alignment was accepted: results are in the {frame}.</source>
        <translation>Die Ausrichtung wurde angenommen: Ergebnisse sind im {frame}.</translation>
    </message>
    <message>
        <source>Results are in the {frame}.</source>
        <translation>Ergebnisse sind im {frame}.</translation>
    </message>
    <message>
        <source>Points have changed since: recalculate (F6)</source>
        <translation>Punkte haben sich seither geändert: neu berechnen (F6)</translation>
    </message>
    <message>
        <source>No frame yet</source>
        <translation>Noch kein System</translation>
    </message>
    <message>
        <source>Still free: {free}</source>
        <translation>Noch frei: {free}</translation>
    </message>
    <message>
        <source>Fully constrained</source>
        <translation>Vollständig bestimmt</translation>
    </message>
    <message>
        <source>U (k=2) of the origin, x y z: {shifts} {unit}. Of rotations about x y z: {turns}°.</source>
        <translation>U (k=2) des Ursprungs, x y z: {shifts} {unit}. Der Drehungen um x y z: {turns}°.</translation>
    </message>
    <message>
        <source>of the uncertainty</source>
        <translation>der Unsicherheit</translation>
    </message>
    <message>
        <source>A: from the observations of this job; B: from other sources; distribution</source>
        <translation>A: aus den Beobachtungen dieses Auftrags; B: aus anderen Quellen; Verteilung</translation>
    </message>
    <message>
        <source>standard uncertainty contributed to the result; m° for angles</source>
        <translation>Beitrag zur Standardunsicherheit des Ergebnisses; m° bei Winkeln</translation>
    </message>
    <message>
        <source>Share</source>
        <translation>Anteil</translation>
    </message>
    <message>
        <source>of the variance</source>
        <translation>an der Varianz</translation>
    </message>
    <message>
        <source>Uncertainty budget</source>
        <translation>Messunsicherheitsbudget</translation>
    </message>
    <message>
        <source>Uncertainty budget as bars</source>
        <translation>Messunsicherheitsbudget als Balken</translation>
    </message>
    <message>
        <source>Together, u</source>
        <translation>Zusammen, u</translation>
    </message>
    <message>
        <source>Choose a folder</source>
        <translation>Ordner wählen</translation>
    </message>
    <message>
        <source>Compare the jobs in a folder</source>
        <translation>Aufträge eines Ordners vergleichen</translation>
    </message>
    <message>
        <source>Show only what is about one feature</source>
        <translation>Nur zeigen, was ein Element betrifft</translation>
    </message>
    <message>
        <source>Write a table (.csv) or pages with the charts (.pdf)</source>
        <translation>Tabelle (.csv) oder Seiten mit den Diagrammen (.pdf) schreiben</translation>
    </message>
    <message>
        <source>Stop reading the jobs</source>
        <translation>Lesen der Aufträge anhalten</translation>
    </message>
    <message>
        <source>included</source>
        <translation>einbezogen</translation>
    </message>
    <message>
        <source>Mean</source>
        <translation>Mittelwert</translation>
    </message>
    <message>
        <source>{unit}, or degrees for angles</source>
        <translation>{unit}, bei Winkeln Grad</translation>
    </message>
    <message>
        <source>Cp</source>
        <translation>Cp</translation>
    </message>
    <message>
        <source>tolerance relative to the scatter of the parts</source>
        <translation>Toleranz zur Streuung der Werkstücke</translation>
    </message>
    <message>
        <source>Cpk</source>
        <translation>Cpk</translation>
    </message>
    <message>
        <source>relative to the nearer limit</source>
        <translation>zur näheren Grenze</translation>
    </message>
    <message>
        <source>95 %</source>
        <translation>95 %</translation>
    </message>
    <message>
        <source>confidence interval of Cpk</source>
        <translation>Vertrauensbereich von Cpk</translation>
    </message>
    <message>
        <source>Signals</source>
        <translation>Signale</translation>
    </message>
    <message>
        <source>of the control chart</source>
        <translation>der Regelkarte</translation>
    </message>
    <message>
        <source>Characteristics of the batch</source>
        <translation>Merkmale der Serie</translation>
    </message>
    <message>
        <source>Compare the jobs from the folder</source>
        <translation>Aufträge des Ordners vergleichen</translation>
    </message>
    <message>
        <source>Compare</source>
        <translation>Vergleichen</translation>
    </message>
    <message>
        <source>Feature; empty for all</source>
        <translation>Element; leer für alle</translation>
    </message>
    <message>
        <source>Write the table of the batch to</source>
        <translation>Tabelle der Serie schreiben nach</translation>
    </message>
    <message numerus="yes">
        <source>{origin}%n jobs of plan {plan}, {first} to {last}.</source>
        <comment>{origin}1 job of plan {plan}, {first} to {last}.</comment>
        <translation>
            <numerusform>{origin}%n Auftrag nach Plan {plan}, {first} bis {last}.</numerusform>
            <numerusform>{origin}%n Aufträge nach Plan {plan}, {first} bis {last}.</numerusform>
        </translation>
    </message>
    <message>
        <source>File of the table</source>
        <translation>Datei der Tabelle</translation>
    </message>
    <message>
        <source>Findings of the chart</source>
        <translation>Befunde der Regelkarte</translation>
    </message>
    <message>
        <source>Excluded</source>
        <translation>Ausgeschlossen</translation>
    </message>
    <message>
        <source>Select the folder with the jobs of the batch.</source>
        <translation>Ordner mit den Aufträgen der Serie wählen.</translation>
    </message>
    <message>
        <source>Pages of the batch written to {path}.</source>
        <translation>Seiten der Serie geschrieben nach {path}.</translation>
    </message>
    <message>
        <source>Writing the pages</source>
        <translation>Seiten werden geschrieben</translation>
    </message>
    <message>
        <source>{path}: the file cannot be written ({reason}).</source>
        <translation>{path}: die Datei kann nicht geschrieben werden ({reason}).</translation>
    </message>
    <message>
        <source>Table of the batch written to {path}.</source>
        <translation>Tabelle der Serie geschrieben nach {path}.</translation>
    </message>
    <message numerus="yes">
        <source>And %n more.</source>
        <translation>
            <numerusform>Und %n weiterer.</numerusform>
            <numerusform>Und %n weitere.</numerusform>
        </translation>
    </message>
    <message>
        <source>{included} of {count}</source>
        <translation>{included} von {count}</translation>
    </message>
    <message>
        <source>Deviations of the touched places</source>
        <translation>Abweichungen der angetasteten Stellen</translation>
    </message>
    <message>
        <source>Arrow keys rotate the view, plus and minus zoom.</source>
        <translation>Pfeiltasten drehen die Ansicht, Plus und Minus zoomen.</translation>
    </message>
    <message>
        <source>Looking for causes</source>
        <translation>Ursachen werden gesucht</translation>
    </message>
    <message>
        <source>Calculating the alignment</source>
        <translation>Ausrichtung wird berechnet</translation>
    </message>
    <message>
        <source>Calculating the uncertainties</source>
        <translation>Unsicherheiten werden berechnet</translation>
    </message>
    <message>
        <source>Points that determine the value</source>
        <translation>Punkte, die den Wert bestimmen</translation>
    </message>
    <message>
        <source>Marked: {points_words}. Arrow keys rotate the view, plus and minus zoom.</source>
        <translation>Markiert: {points_words}. Pfeiltasten drehen die Ansicht, Plus und Minus zoomen.</translation>
    </message>
    <message>
        <source>Cameras: {cameras}. Probe: {probe}. Plan: {release}.</source>
        <translation>Kameras: {cameras}. Taster: {probe}. Plan: {release}.</translation>
    </message>
    <message>
        <source>Current job {job}, part {part}. {who}.</source>
        <translation>Laufender Auftrag {job}, Werkstück {part}. {who}.</translation>
    </message>
    <message>
        <source>Recomputed from raw data: matches the file.</source>
        <translation>Aus Rohdaten neu berechnet: stimmt mit der Datei überein.</translation>
    </message>
    <message>
        <source>{name}, read-only, part {part}. {who}. {doubts}</source>
        <translation>{name}, nur lesbar, Werkstück {part}. {who}. {doubts}</translation>
    </message>
    <message>
        <source>Template</source>
        <translation>Vorlage</translation>
    </message>
    <message>
        <source>TOML</source>
        <translation>TOML</translation>
    </message>
    <message>
        <source>Where the job has none</source>
        <translation>Falls der Auftrag keine nennt</translation>
    </message>
    <message>
        <source>Drawing</source>
        <translation>Zeichnung</translation>
    </message>
    <message>
        <source>Drawing of the part</source>
        <translation>Zeichnung des Werkstücks</translation>
    </message>
    <message>
        <source>Revision</source>
        <translation>Revision</translation>
    </message>
    <message>
        <source>Revision of the drawing</source>
        <translation>Revision der Zeichnung</translation>
    </message>
    <message>
        <source>Where it was measured</source>
        <translation>Wo gemessen wurde</translation>
    </message>
    <message>
        <source>Received</source>
        <translation>Eingang</translation>
    </message>
    <message>
        <source>Date and condition</source>
        <translation>Datum und Zustand</translation>
    </message>
    <message>
        <source>A number or a range</source>
        <translation>Eine Zahl oder ein Bereich</translation>
    </message>
    <message>
        <source>Deviations</source>
        <translation>Abweichungen</translation>
    </message>
    <message>
        <source>Parted by semicolons</source>
        <translation>Durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Head of the report</source>
        <translation>Kopf des Berichts</translation>
    </message>
    <message>
        <source>Fault of the template</source>
        <translation>Fehler der Vorlage</translation>
    </message>
    <message>
        <source>Mark</source>
        <translation>Auswählen</translation>
    </message>
    <message>
        <source>Select or clear this format</source>
        <translation>Dieses Format an- oder abwählen</translation>
    </message>
    <message>
        <source>Write the selected formats to the folder</source>
        <translation>Gewählte Formate in den Ordner schreiben</translation>
    </message>
    <message>
        <source>F8 cancels.</source>
        <translation>F8 bricht ab.</translation>
    </message>
    <message>
        <source>Report</source>
        <translation>Bericht</translation>
    </message>
    <message>
        <source>Formats</source>
        <translation>Formate</translation>
    </message>
    <message>
        <source>Up and down show a preview, Space selects a format</source>
        <translation>Auf und Ab zeigen eine Vorschau, die Leertaste wählt ein Format</translation>
    </message>
    <message>
        <source>The job is not complete</source>
        <translation>Der Auftrag ist nicht vollständig</translation>
    </message>
    <message>
        <source>Writing the report</source>
        <translation>Bericht wird geschrieben</translation>
    </message>
    <message>
        <source>Report folder</source>
        <translation>Ordner des Berichts</translation>
    </message>
    <message>
        <source>Preview</source>
        <translation>Vorschau</translation>
    </message>
    <message>
        <source>Preparing the preview</source>
        <translation>Vorschau wird vorbereitet</translation>
    </message>
    <message>
        <source>The report was not written.</source>
        <translation>Der Bericht wurde nicht geschrieben.</translation>
    </message>
    <message numerus="yes">
        <source>%n files</source>
        <comment>1 file</comment>
        <translation>
            <numerusform>%n Datei</numerusform>
            <numerusform>%n Dateien</numerusform>
        </translation>
    </message>
    <message>
        <source>INCOMPLETE report of {job} written to {folder} ({files}).</source>
        <translation>UNVOLLSTÄNDIGER Bericht zu {job} in {folder} geschrieben ({files}).</translation>
    </message>
    <message>
        <source>Not measured: {missing_words}.</source>
        <translation>Nicht gemessen: {missing_words}.</translation>
    </message>
    <message>
        <source>Written to {folder}: {names}</source>
        <translation>In {folder} geschrieben: {names}</translation>
    </message>
    <message>
        <source>INCOMPLETE: {missing_words} not measured. Write the report of {job} anyway?</source>
        <translation>UNVOLLSTÄNDIG: {missing_words} nicht gemessen. Bericht zu {job} trotzdem schreiben?</translation>
    </message>
    <message>
        <source>Analysing the cause ...</source>
        <translation>Ursache wird gesucht ...</translation>
    </message>
    <message>
        <source>Calculating the budget from the job file.</source>
        <translation>Budget wird aus der Auftragsdatei berechnet.</translation>
    </message>
    <message>
        <source>Selected result</source>
        <translation>Ausgewähltes Ergebnis</translation>
    </message>
    <message>
        <source>Monte Carlo</source>
        <translation>Monte Carlo</translation>
    </message>
    <message>
        <source>Simulation cancelled.</source>
        <translation>Simulation abgebrochen.</translation>
    </message>
    <message>
        <source>Trials run in a separate process. F6 stops them.</source>
        <translation>Die Versuche laufen in einem eigenen Prozess. F6 hält sie an.</translation>
    </message>
    <message>
        <source>F6 checks U by Monte Carlo (JCGM 101).</source>
        <translation>F6 prüft U durch Monte Carlo (JCGM 101).</translation>
    </message>
    <message>
        <source>Rule: {rule}.</source>
        <translation>Regel: {rule}.</translation>
    </message>
    <message>
        <source>The value lies inside.</source>
        <translation>Der Wert liegt innerhalb.</translation>
    </message>
    <message>
        <source>The value lies outside.</source>
        <translation>Der Wert liegt außerhalb.</translation>
    </message>
    <message>
        <source>95 % interval {low} to {high}.</source>
        <translation>95-%-Intervall {low} bis {high}.</translation>
    </message>
    <message>
        <source>Tolerance over 2 U: {tur:.1f}.</source>
        <translation>Toleranz zu 2 U: {tur:.1f}.</translation>
    </message>
    <message>
        <source>Association: {association}.</source>
        <translation>Zuordnung: {association}.</translation>
    </message>
    <message>
        <source>Frame: {frame}.</source>
        <translation>System: {frame}.</translation>
    </message>
    <message>
        <source>Noise floor: {floor}.</source>
        <translation>Grundrauschen: {floor}.</translation>
    </message>
    <message>
        <source>Bonus {bonus}.</source>
        <translation>Bonus {bonus}.</translation>
    </message>
    <message>
        <source>Monte Carlo (JCGM 101), {trials:,} trials: 2 u = {width:.2f} {unit}, interval {low} to {high}.</source>
        <translation>Monte Carlo (JCGM 101), {trials:,} Versuche: 2 u = {width:.2f} {unit}, Intervall {low} bis {high}.</translation>
    </message>
    <message>
        <source>the ends differ by {off:.2f} {unit}, tolerance {tolerance:.2g} {unit}</source>
        <translation>die Enden unterscheiden sich um {off:.2f} {unit}, Toleranz {tolerance:.2g} {unit}</translation>
    </message>
    <message>
        <source>It does not confirm linear propagation: {differ}.</source>
        <translation>Die lineare Fortpflanzung wird nicht bestätigt: {differ}.</translation>
    </message>
    <message>
        <source>It confirms linear propagation: {differ}.</source>
        <translation>Die lineare Fortpflanzung wird bestätigt: {differ}.</translation>
    </message>
    <message>
        <source>More trials are needed to be certain.</source>
        <translation>Mehr Versuche nötig, um sicher zu sein.</translation>
    </message>
    <message>
        <source>Of</source>
        <translation>Von</translation>
    </message>
    <message>
        <source>kind and features</source>
        <translation>Art und Elemente</translation>
    </message>
    <message>
        <source>measured minus nominal</source>
        <translation>Gemessen minus Nennmaß</translation>
    </message>
    <message>
        <source>Limits</source>
        <translation>Grenzen</translation>
    </message>
    <message>
        <source>of the deviation</source>
        <translation>der Abweichung</translation>
    </message>
    <message>
        <source>expanded uncertainty</source>
        <translation>erweiterte Unsicherheit</translation>
    </message>
    <message>
        <source>the decision</source>
        <translation>die Entscheidung</translation>
    </message>
    <message>
        <source>Check this uncertainty by Monte Carlo</source>
        <translation>Diese Unsicherheit durch Monte Carlo prüfen</translation>
    </message>
    <message>
        <source>Open a job</source>
        <translation>Auftrag öffnen</translation>
    </message>
    <message>
        <source>Open a job file read-only</source>
        <translation>Auftragsdatei nur zum Lesen öffnen</translation>
    </message>
    <message>
        <source>Current job</source>
        <translation>Laufender Auftrag</translation>
    </message>
    <message>
        <source>Show the current job</source>
        <translation>Laufenden Auftrag zeigen</translation>
    </message>
    <message>
        <source>Compare the jobs in this folder</source>
        <translation>Aufträge in diesem Ordner vergleichen</translation>
    </message>
    <message>
        <source>Preview and write the reports</source>
        <translation>Vorschau der Berichte, und sie schreiben</translation>
    </message>
    <message>
        <source>Open the job from the file</source>
        <translation>Auftrag aus Datei öffnen</translation>
    </message>
    <message>
        <source>File of the job</source>
        <translation>Datei des Auftrags</translation>
    </message>
    <message>
        <source>Opening a job</source>
        <translation>Auftrag wird geöffnet</translation>
    </message>
    <message>
        <source>Summary</source>
        <translation>Übersicht</translation>
    </message>
    <message>
        <source>The job was not opened.</source>
        <translation>Der Auftrag wurde nicht geöffnet.</translation>
    </message>
    <message>
        <source>Opening {name}</source>
        <translation>{name} wird geöffnet</translation>
    </message>
    <message>
        <source>F7 cancels.</source>
        <translation>F7 bricht ab.</translation>
    </message>
    <message>
        <source>{name}: {verdict}</source>
        <translation>{name}: {verdict}</translation>
    </message>
    <message>
        <source>Image of camera {name}</source>
        <translation>Bild der Kamera {name}</translation>
    </message>
    <message numerus="yes">
        <source>{name}:  %n spots</source>
        <comment>{name}:  1 spot</comment>
        <translation>
            <numerusform>{name}:  %n Lichtpunkt</numerusform>
            <numerusform>{name}:  %n Lichtpunkte</numerusform>
        </translation>
    </message>
    <message>
        <source>{told}, {named} named</source>
        <translation>{told}, {named} benannt</translation>
    </message>
    <message>
        <source>Camera images</source>
        <translation>Kamerabilder</translation>
    </message>
    <message>
        <source>{number} outlier</source>
        <translation>{number} Ausreißer</translation>
    </message>
    <message>
        <source>point {chosen}</source>
        <translation>Punkt {chosen}</translation>
    </message>
    <message>
        <source>next, roughly</source>
        <translation>nächster, ungefähr</translation>
    </message>
    <message>
        <source>next</source>
        <translation>nächster</translation>
    </message>
    <message>
        <source>touch here first, roughly</source>
        <translation>hier zuerst antasten, ungefähr</translation>
    </message>
    <message>
        <source>{count} too much</source>
        <translation>{count} zu viel</translation>
    </message>
    <message>
        <source>{count} too little</source>
        <translation>{count} zu wenig</translation>
    </message>
    <message>
        <source>{count} accepted</source>
        <translation>{count} angenommen</translation>
    </message>
    <message>
        <source>{count} within, not accepted</source>
        <translation>{count} innerhalb, nicht angenommen</translation>
    </message>
    <message>
        <source>{count} held back</source>
        <translation>{count} zurückgehalten</translation>
    </message>
    <message>
        <source>Deviation from the middle of the zone, × {factor:g}</source>
        <translation>Abweichung von der Mitte der Zone, × {factor:g}</translation>
    </message>
    <message>
        <source>lower limit</source>
        <translation>untere Grenze</translation>
    </message>
    <message>
        <source>upper limit</source>
        <translation>obere Grenze</translation>
    </message>
    <message>
        <source>Colour: between points, to {reach:.1f} mm. Grey: not measured.</source>
        <translation>Farbe: zwischen Punkten, bis {reach:.1f} mm. Grau: nicht gemessen.</translation>
    </message>
    <message>
        <source>Picture of the part</source>
        <translation>Bild des Werkstücks</translation>
    </message>
    <message>
        <source>Arrow keys rotate the view, plus and minus zoom, F fits it to the part</source>
        <translation>Pfeiltasten drehen die Ansicht, Plus und Minus zoomen, F zeigt das ganze Werkstück</translation>
    </message>
    <message>
        <source>No model</source>
        <translation>Kein Modell</translation>
    </message>
    <message>
        <source>3-D view</source>
        <translation>3-D-Ansicht</translation>
    </message>
    <message>
        <source>Part placed roughly: not aligned yet</source>
        <translation>Werkstück ungefähr gezeigt: noch nicht ausgerichtet</translation>
    </message>
    <message>
        <source>Part not located yet. Touch {feature}.</source>
        <translation>Lage des Werkstücks noch unbekannt. {feature} antasten.</translation>
    </message>
    <message>
        <source>Part not located yet, placed roughly. Touch {feature} on the real part.</source>
        <translation>Lage des Werkstücks noch unbekannt, ungefähr gezeigt. {feature} am echten Werkstück antasten.</translation>
    </message>
    <message>
        <source>Picture of the step</source>
        <translation>Bild des Schritts</translation>
    </message>
    <message>
        <source>world axes, grid {grid_step:.0f} mm</source>
        <translation>Weltachsen, Raster {grid_step:.0f} mm</translation>
    </message>
    <message>
        <source>No certificate can be written.</source>
        <translation>Es kann kein Zertifikat geschrieben werden.</translation>
    </message>
    <message>
        <source>This window was opened without acceptance tests.</source>
        <translation>Dieses Fenster wurde ohne Annahmeprüfungen geöffnet.</translation>
    </message>
    <message>
        <source>About</source>
        <translation>Über</translation>
    </message>
    <message>
        <source>Version, licences and folders of OCMM</source>
        <translation>Version, Lizenzen und Ordner von OCMM</translation>
    </message>
    <message>
        <source>mode in which the key works</source>
        <translation>Betriebsart, in der die Taste wirkt</translation>
    </message>
    <message>
        <source>Key</source>
        <translation>Taste</translation>
    </message>
    <message>
        <source>any of them</source>
        <translation>eine davon</translation>
    </message>
    <message>
        <source>on the button</source>
        <translation>auf der Schaltfläche</translation>
    </message>
    <message>
        <source>What it does</source>
        <translation>Was sie tut</translation>
    </message>
    <message>
        <source>in a sentence</source>
        <translation>in einem Satz</translation>
    </message>
    <message>
        <source>. (full stop)</source>
        <translation>. (Punkt)</translation>
    </message>
    <message>
        <source>, (comma)</source>
        <translation>, (Komma)</translation>
    </message>
    <message>
        <source>Keys of the window</source>
        <translation>Tasten des Fensters</translation>
    </message>
    <message>
        <source>F1 to F5, F11 and F12 mean the same everywhere; F6 to F10 belong to the page. Settings changes keys.</source>
        <translation>F1 bis F5, F11 und F12 bedeuten überall dasselbe; F6 bis F10 gehören der Seite. Tasten ändern: Einstellungen.</translation>
    </message>
    <message>
        <source>everywhere</source>
        <translation>überall</translation>
    </message>
    <message>
        <source> or </source>
        <translation> oder </translation>
    </message>
    <message>
        <source>Desk view</source>
        <translation>Nahansicht</translation>
    </message>
    <message>
        <source>Calculating the results</source>
        <translation>Ergebnisse werden berechnet</translation>
    </message>
    <message>
        <source>Points are taken again: {title} is {word}.</source>
        <translation>Punkte werden wieder aufgenommen: {title} ist {word}.</translation>
    </message>
    <message>
        <source>The cameras now store the intrinsics of the calibration.</source>
        <translation>Die Kameras speichern jetzt die Abbildungsparameter der Kalibrierung.</translation>
    </message>
    <message>
        <source>The cameras on their wire</source>
        <translation>Die Kameras an ihrem Kabel</translation>
    </message>
    <message>
        <source>Rig plan</source>
        <translation>Systemplan</translation>
    </message>
    <message>
        <source>U of a planned rig, and as calibrated</source>
        <translation>U eines geplanten Kamerasystems, und wie kalibriert</translation>
    </message>
    <message>
        <source>Calibration status of the cameras</source>
        <translation>Stand der Kamerakalibrierung</translation>
    </message>
    <message>
        <source>Status of probe and tip</source>
        <translation>Stand von Taster und Tastspitze</translation>
    </message>
    <message>
        <source>Probe design</source>
        <translation>Konstruktion</translation>
    </message>
    <message>
        <source>Uncertainty of the tip and its causes</source>
        <translation>Messunsicherheit der Tastspitze und ihre Ursachen</translation>
    </message>
    <message>
        <source>Fits</source>
        <translation>Einpassungen</translation>
    </message>
    <message>
        <source>Check of the fits against certified pairs</source>
        <translation>Prüfung der Einpassungen an zertifizierten Paaren</translation>
    </message>
    <message>
        <source>Acceptance tests, interim checks, artefacts and gauge studies</source>
        <translation>Annahmeprüfungen, Zwischenprüfungen, Prüfkörper und Prüfmittelfähigkeit</translation>
    </message>
    <message>
        <source>Acceptance</source>
        <translation>Annahme</translation>
    </message>
    <message>
        <source>No calibrations of these cameras are kept.</source>
        <translation>Von diesen Kameras sind keine Kalibrierungen aufbewahrt.</translation>
    </message>
    <message>
        <source>No records of this probe are kept.</source>
        <translation>Von diesem Taster sind keine Aufzeichnungen aufbewahrt.</translation>
    </message>
    <message>
        <source>Select a test on page Acceptance, or open page Calibration or Probe.</source>
        <translation>Prüfung auf der Seite „Annahme“ wählen, oder die Seite „Kalibrierung“ oder „Taster“ öffnen.</translation>
    </message>
    <message>
        <source>Probe saved in {path}. Choose it in Settings (Instrument), then calibrate it.</source>
        <translation>Taster gespeichert in {path}. In den Einstellungen wählen (Gerät), dann kalibrieren.</translation>
    </message>
    <message>
        <source>PolyWorks</source>
        <translation>PolyWorks</translation>
    </message>
    <message>
        <source>QIF</source>
        <translation>QIF</translation>
    </message>
    <message>
        <source>Q-DAS</source>
        <translation>Q-DAS</translation>
    </message>
    <message>
        <source>XLSX</source>
        <translation>XLSX</translation>
    </message>
    <message>
        <source>JSON</source>
        <translation>JSON</translation>
    </message>
    <message>
        <source>PDF</source>
        <translation>PDF</translation>
    </message>
    <message>
        <source>AS9102</source>
        <translation>AS9102</translation>
    </message>
    <message>
        <source>Write the report into the folder</source>
        <translation>Bericht in den Ordner schreiben</translation>
    </message>
    <message>
        <source>Folder of the report</source>
        <translation>Ordner des Berichts</translation>
    </message>
    <message>
        <source>Write the bus report into the file</source>
        <translation>Busbericht in die Datei schreiben</translation>
    </message>
    <message>
        <source>File of the bus report</source>
        <translation>Datei des Busberichts</translation>
    </message>
    <message>
        <source>E cancels.</source>
        <translation>E bricht ab.</translation>
    </message>
    <message>
        <source>The bus report is in {path}.</source>
        <translation>Der Busbericht steht in {path}.</translation>
    </message>
    <message>
        <source>{format} + {count}</source>
        <translation>{format} + {count}</translation>
    </message>
    <message>
        <source>Write the report files: {titles}</source>
        <translation>Berichtsdateien schreiben: {titles}</translation>
    </message>
    <message>
        <source>Log written to {path}.</source>
        <translation>Log geschrieben nach {path}.</translation>
    </message>
    <message>
        <source>Write the certificate into the folder</source>
        <translation>Zertifikat in den Ordner schreiben</translation>
    </message>
    <message>
        <source>Folder of the certificate</source>
        <translation>Ordner des Zertifikats</translation>
    </message>
    <message>
        <source>Writing the certificate</source>
        <translation>Zertifikat wird geschrieben</translation>
    </message>
    <message>
        <source>Certificate written: {path}, with DCC and signature.</source>
        <translation>Zertifikat geschrieben: {path}, mit DCC und Signatur.</translation>
    </message>
    <message>
        <source>Plan saved in {path}. Shift+F8 starts a job with it.</source>
        <translation>Plan gespeichert in {path}. Umschalt+F8 beginnt einen Auftrag damit.</translation>
    </message>
    <message>
        <source>Reference points</source>
        <translation>Referenzpunkte</translation>
    </message>
    <message>
        <source>List of positions: unit, uncertainty, points</source>
        <translation>Liste der Positionen: Einheit, Unsicherheit, Punkte</translation>
    </message>
    <message>
        <source>Length bar</source>
        <translation>Längenmaßstab</translation>
    </message>
    <message>
        <source>Its document, with the certificate</source>
        <translation>Sein Dokument, mit dem Kalibrierschein</translation>
    </message>
    <message>
        <source>World frame</source>
        <translation>Weltsystem</translation>
    </message>
    <message>
        <source>Reference of the coordinates afterwards</source>
        <translation>Bezug der Koordinaten danach</translation>
    </message>
    <message>
        <source>fixed to the cameras</source>
        <translation>fest mit den Kameras</translation>
    </message>
    <message>
        <source>fixed by known control points</source>
        <translation>fest durch bekannte Kontrollpunkte</translation>
    </message>
    <message>
        <source>redefined by three points</source>
        <translation>durch drei Punkte neu festgelegt</translation>
    </message>
    <message>
        <source>Their list, if known points keep the world frame</source>
        <translation>Ihre Liste, wenn bekannte Punkte das Weltsystem halten</translation>
    </message>
    <message>
        <source>Lenses</source>
        <translation>Objektive</translation>
    </message>
    <message>
        <source>Lens parameters</source>
        <translation>Parameter der Objektive</translation>
    </message>
    <message>
        <source>refined from known values</source>
        <translation>aus bekannten Werten verfeinert</translation>
    </message>
    <message>
        <source>unchanged</source>
        <translation>unverändert</translation>
    </message>
    <message>
        <source>found anew</source>
        <translation>neu bestimmt</translation>
    </message>
    <message>
        <source>Source of the LED positions</source>
        <translation>Quelle der LED-Positionen</translation>
    </message>
    <message>
        <source>known within their uncertainty</source>
        <translation>bekannt bis auf die Unsicherheit</translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation>genau bekannt</translation>
    </message>
    <message>
        <source>unknown: scale from the bar alone</source>
        <translation>unbekannt: Skala nur aus dem Maßstab</translation>
    </message>
    <message>
        <source>Not the one used to calibrate the cameras</source>
        <translation>Nicht der, mit dem die Kameras kalibriert wurden</translation>
    </message>
    <message>
        <source>Sphere</source>
        <translation>Kugel</translation>
    </message>
    <message>
        <source>Its document; empty for none</source>
        <translation>Ihr Dokument; leer für keine</translation>
    </message>
    <message>
        <source>Sphere in</source>
        <translation>Kugel an</translation>
    </message>
    <message>
        <source>Number of places in the volume</source>
        <translation>Anzahl Stellen im Volumen</translation>
    </message>
    <message>
        <source>one place</source>
        <translation>einer Stelle</translation>
    </message>
    <message>
        <source>near and far third</source>
        <translation>nahem und fernem Drittel</translation>
    </message>
    <message>
        <source>Reason, for the history</source>
        <translation>Grund, für den Verlauf</translation>
    </message>
    <message>
        <source>A reason is required</source>
        <translation>Ein Grund ist nötig</translation>
    </message>
    <message>
        <source>Decision</source>
        <translation>Entscheidung</translation>
    </message>
    <message>
        <source>Reason</source>
        <translation>Grund</translation>
    </message>
    <message>
        <source>Yes  [Return]</source>
        <translation>Ja  [Eingabe]</translation>
    </message>
    <message>
        <source>No  [Esc]</source>
        <translation>Nein  [Esc]</translation>
    </message>
    <message>
        <source>Plot 1</source>
        <translation>Bild 1</translation>
    </message>
    <message>
        <source>Show plot 1</source>
        <translation>Bild 1 zeigen</translation>
    </message>
    <message>
        <source>Plot 2</source>
        <translation>Bild 2</translation>
    </message>
    <message>
        <source>Show plot 2</source>
        <translation>Bild 2 zeigen</translation>
    </message>
    <message>
        <source>Plot 3</source>
        <translation>Bild 3</translation>
    </message>
    <message>
        <source>Show plot 3</source>
        <translation>Bild 3 zeigen</translation>
    </message>
    <message>
        <source>Plot 4</source>
        <translation>Bild 4</translation>
    </message>
    <message>
        <source>Show plot 4</source>
        <translation>Bild 4 zeigen</translation>
    </message>
    <message>
        <source>Take an observation now</source>
        <translation>Jetzt eine Beobachtung aufnehmen</translation>
    </message>
    <message>
        <source>Undo the last observation of this step</source>
        <translation>Letzte Beobachtung dieses Schritts zurücknehmen</translation>
    </message>
    <message>
        <source>Go to the next step</source>
        <translation>Weiter zum nächsten Schritt</translation>
    </message>
    <message>
        <source>Back to the previous step; nothing is lost</source>
        <translation>Zurück zum vorigen Schritt; nichts geht verloren</translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation>Automatik</translation>
    </message>
    <message>
        <source>Turn automatic taking on or off</source>
        <translation>Automatisches Aufnehmen ein- oder ausschalten</translation>
    </message>
    <message>
        <source>Skip this point: no camera sees it</source>
        <translation>Diesen Punkt auslassen: keine Kamera sieht ihn</translation>
    </message>
    <message>
        <source>Repeat line</source>
        <translation>Linie neu messen</translation>
    </message>
    <message>
        <source>Repeat a misplaced or failed line</source>
        <translation>Falsch gelegte oder nicht bestandene Linie neu messen</translation>
    </message>
    <message>
        <source>Repeat sweep</source>
        <translation>Schwenk wiederholen</translation>
    </message>
    <message>
        <source>Discard this sweep and repeat it</source>
        <translation>Diesen Schwenk verwerfen und wiederholen</translation>
    </message>
    <message>
        <source>Calculate</source>
        <translation>Berechnen</translation>
    </message>
    <message>
        <source>Recalculate the result</source>
        <translation>Ergebnis neu berechnen</translation>
    </message>
    <message>
        <source>Cancel the calculation</source>
        <translation>Berechnung abbrechen</translation>
    </message>
    <message>
        <source>Activate the result</source>
        <translation>Ergebnis in Kraft setzen</translation>
    </message>
    <message>
        <source>Keep the old</source>
        <translation>Altes behalten</translation>
    </message>
    <message>
        <source>End without changes</source>
        <translation>Ohne Änderung beenden</translation>
    </message>
    <message>
        <source>Leave</source>
        <translation>Verlassen</translation>
    </message>
    <message>
        <source>Back to Maintain; the session can be resumed</source>
        <translation>Zurück zur Wartung; die Sitzung kann fortgesetzt werden</translation>
    </message>
    <message>
        <source>Cone</source>
        <translation>Kegelsitz</translation>
    </message>
    <message>
        <source>Its marking; empty if none</source>
        <translation>Seine Beschriftung; leer, wenn keine</translation>
    </message>
    <message>
        <source>Marking on the mounted stylus</source>
        <translation>Beschriftung auf dem montierten Taststift</translation>
    </message>
    <message>
        <source>Where the tip is</source>
        <translation>Wo die Kugel ist</translation>
    </message>
    <message>
        <source>What is already known of it</source>
        <translation>Was schon darüber bekannt ist</translation>
    </message>
    <message>
        <source>close to the probe document or the last calibration</source>
        <translation>nahe dem Tasterdokument oder der letzten Kalibrierung</translation>
    </message>
    <message>
        <source>unknown: another stylus</source>
        <translation>unbekannt: anderer Taststift</translation>
    </message>
    <message>
        <source>Nominal diameter</source>
        <translation>Nenndurchmesser</translation>
    </message>
    <message>
        <source>Currently mounted</source>
        <translation>Jetzt montiert</translation>
    </message>
    <message>
        <source>Steps</source>
        <translation>Schritte</translation>
    </message>
    <message>
        <source>Step {current} of {count}: {title}</source>
        <translation>Schritt {current} von {count}: {title}</translation>
    </message>
    <message>
        <source>{done} of {wanted}</source>
        <translation>{done} von {wanted}</translation>
    </message>
    <message>
        <source>The new calibration is active. Verify it: until then it is SUSPECT and no points are taken.</source>
        <translation>Die neue Kalibrierung ist in Kraft. Verifizieren: bis dahin ist sie FRAGLICH, und es werden keine Punkte aufgenommen.</translation>
    </message>
    <message>
        <source>A positioning machine moves one bright target to every point of a list, through the full depth of the volume. Lens parameters and camera poses are computed from the images.</source>
        <translation>Ein Positioniergerät fährt ein helles Ziel an jeden Punkt einer Liste, durch die ganze Tiefe des Volumens. Objektive und Lagen der Kameras werden aus den Bildern berechnet.</translation>
    </message>
    <message>
        <source>Errors at points held back</source>
        <translation>Abweichungen an zurückgehaltenen Punkten</translation>
    </message>
    <message>
        <source>Use after the frame or a camera was moved: visit two seats, wave the probe through the volume, show the length bar, touch the control points, and visit the seats again. No measuring machine needed.</source>
        <translation>Wenn Gestell oder Kamera bewegt wurde: zwei Plätze besuchen, den Taster durch das Volumen führen, den Längenmaßstab zeigen, die Kontrollpunkte antasten und die Plätze nochmals besuchen. Kein Messgerät nötig.</translation>
    </message>
    <message>
        <source>Misfits of bar and control points</source>
        <translation>Restabweichungen von Maßstab und Kontrollpunkten</translation>
    </message>
    <message>
        <source>Measures the noise of an optical tracker: the clamped probe rests for a minute, then at places all over the volume. Scale and noise are proven by the verification.</source>
        <translation>Misst das Rauschen eines optischen Trackers: Der eingespannte Taster ruht eine Minute, dann an Stellen im ganzen Volumen. Maßstab und Rauschen beweist die Verifikation.</translation>
    </message>
    <message>
        <source>An independent check: visit two seats, put the ball into the nests of a certified length bar along seven lines, touch a certified sphere, and visit the seats again. Only a calibration that passes can be used.</source>
        <translation>Eine unabhängige Prüfung: zwei Plätze besuchen, die Kugel an sieben Linien in die Aufnahmen eines zertifizierten Längenmaßstabs setzen, eine zertifizierte Kugel antasten und die Plätze nochmals besuchen. Nur eine Kalibrierung, die besteht, kann genutzt werden.</translation>
    </message>
    <message>
        <source>Verdict stored.</source>
        <translation>Urteil gespeichert.</translation>
    </message>
    <message>
        <source>Rest the ball in a cone and pivot the probe about it, repeat in another cone or leaning another way, then return to the first cone. Tip and LED positions are computed from the sweeps.</source>
        <translation>Kugel in einen Kegelsitz setzen und den Taster darum schwenken, in einem anderen Kegelsitz oder anders geneigt wiederholen, dann zurück in den ersten Kegelsitz. Kugelmitte und LEDs werden aus dem Schwenken berechnet.</translation>
    </message>
    <message>
        <source>The new probe calibration is active. Qualify the tip: until then it is SUSPECT and no points are taken.</source>
        <translation>Die neue Kalibrierung des Tasters ist in Kraft. Tastspitze einmessen: bis dahin ist sie FRAGLICH, und es werden keine Punkte aufgenommen.</translation>
    </message>
    <message>
        <source>Touch a certified sphere all around, then rest the ball in a cone in five attitudes. This gives the diameter and form of the ball, and shows whether the tip stays in place.</source>
        <translation>Eine zertifizierte Kugel ringsum antasten, dann die Tastkugel in fünf Stellungen in einen Kegelsitz setzen. Das ergibt Durchmesser und Form der Tastkugel und zeigt, ob sie an ihrem Platz bleibt.</translation>
    </message>
    <message>
        <source>Tip verdict stored.</source>
        <translation>Urteil über die Tastspitze gespeichert.</translation>
    </message>
    <message>
        <source>One minute on the sphere and in the cone: is the tip still as qualified?</source>
        <translation>Eine Minute an der Kugel und im Kegelsitz: ist die Tastspitze noch wie eingemessen?</translation>
    </message>
    <message>
        <source>Wizard</source>
        <translation>Assistent</translation>
    </message>
    <message>
        <source>Step</source>
        <translation>Schritt</translation>
    </message>
    <message>
        <source>Why Next is locked</source>
        <translation>Warum „Weiter“ gesperrt ist</translation>
    </message>
    <message>
        <source>Automatic: ON
[Y]</source>
        <translation>Automatik: EIN
[Y]</translation>
    </message>
    <message>
        <source>Automatic: off
[Y]</source>
        <translation>Automatik: aus
[Y]</translation>
    </message>
    <message>
        <source>Practice: the records of this station are unchanged.</source>
        <translation>Übung: Die Aufzeichnungen dieser Station sind unverändert.</translation>
    </message>
    <message>
        <source>The cameras use the rig document: no calibrations are stored.</source>
        <translation>Die Kameras nutzen das Systemdokument: keine Kalibrierungen sind gespeichert.</translation>
    </message>
    <message>
        <source>Choose real cameras, or a folder of camera records, in Settings (Instrument).</source>
        <translation>In den Einstellungen (Gerät) echte Kameras oder einen Ordner mit Kameraprotokollen wählen.</translation>
    </message>
    <message>
        <source>The probe uses its document: no records of it are stored.</source>
        <translation>Der Taster nutzt sein Dokument: keine Aufzeichnungen sind gespeichert.</translation>
    </message>
    <message>
        <source>Choose real cameras, or a folder of tip records, in Settings (Instrument).</source>
        <translation>In den Einstellungen (Gerät) echte Kameras oder einen Ordner mit Tasterprotokollen wählen.</translation>
    </message>
    <message>
        <source>No probe selected.</source>
        <translation>Kein Taster gewählt.</translation>
    </message>
    <message>
        <source>Purpose</source>
        <translation>Zweck</translation>
    </message>
    <message>
        <source>Start a new session</source>
        <translation>Neue Sitzung beginnen</translation>
    </message>
    <message>
        <source>Resume the selected session</source>
        <translation>Ausgewählte Sitzung fortsetzen</translation>
    </message>
    <message>
        <source>Leave the wizard</source>
        <translation>Assistenten verlassen</translation>
    </message>
    <message>
        <source>Unfinished sessions</source>
        <translation>Unfertige Sitzungen</translation>
    </message>
    <message>
        <source>Details of the selected session</source>
        <translation>Einzelheiten der ausgewählten Sitzung</translation>
    </message>
    <message>
        <source>New session</source>
        <translation>Neue Sitzung</translation>
    </message>
    <message>
        <source>Nothing was lost.</source>
        <translation>Nichts ging verloren.</translation>
    </message>
    <message>
        <source>Name of the probe, used in its records</source>
        <translation>Name des Tasters, in seinen Aufzeichnungen</translation>
    </message>
    <message>
        <source>Tip, mm</source>
        <translation>Kugelmitte, mm</translation>
    </message>
    <message>
        <source>Centre of the ball in the probe frame: x y z</source>
        <translation>Mitte der Tastkugel im Tastersystem: x y z</translation>
    </message>
    <message>
        <source>Diameter from the maker&apos;s certificate</source>
        <translation>Durchmesser laut Zertifikat des Herstellers</translation>
    </message>
    <message>
        <source>Ball ±, mm</source>
        <translation>Kugel ±, mm</translation>
    </message>
    <message>
        <source>Standard uncertainty of the diameter</source>
        <translation>Standardunsicherheit des Durchmessers</translation>
    </message>
    <message>
        <source>Tip ±, mm</source>
        <translation>Kugelmitte ±, mm</translation>
    </message>
    <message>
        <source>Standard uncertainties of its position: x y z</source>
        <translation>Standardunsicherheiten ihrer Position: x y z</translation>
    </message>
    <message>
        <source>LEDs ±, mm</source>
        <translation>LEDs ±, mm</translation>
    </message>
    <message>
        <source>Standard uncertainty of each coordinate of an LED</source>
        <translation>Standardunsicherheit jeder Koordinate einer LED</translation>
    </message>
    <message>
        <source>Light, °</source>
        <translation>Licht, °</translation>
    </message>
    <message>
        <source>Largest viewing angle off its direction</source>
        <translation>Größter Blickwinkel zu ihrer Richtung</translation>
    </message>
    <message>
        <source>Rules</source>
        <translation>Regeln</translation>
    </message>
    <message>
        <source>Orientation rules: probe axis &gt; direction; x y z &gt; x y z; …; empty: none</source>
        <translation>Lageregeln: Tasterachse &gt; Richtung; x y z &gt; x y z; …; leer: keine</translation>
    </message>
    <message>
        <source>Strobe</source>
        <translation>Blitzcode</translation>
    </message>
    <message>
        <source>Period in frames: dark frame of each LED; empty: always on</source>
        <translation>Periode in Bildern: dunkles Bild jeder LED; leer: immer an</translation>
    </message>
    <message>
        <source>File</source>
        <translation>Datei</translation>
    </message>
    <message>
        <source>New name; a used document is never changed</source>
        <translation>Neuer Name; ein benutztes Dokument wird nie geändert</translation>
    </message>
    <message>
        <source>always on</source>
        <translation>immer an</translation>
    </message>
    <message>
        <source>LED</source>
        <translation>LED</translation>
    </message>
    <message>
        <source>its number</source>
        <translation>ihre Nummer</translation>
    </message>
    <message>
        <source>probe frame</source>
        <translation>Tastersystem</translation>
    </message>
    <message>
        <source>emission direction; length is ignored</source>
        <translation>Abstrahlrichtung; die Länge zählt nicht</translation>
    </message>
    <message>
        <source>emission direction</source>
        <translation>Abstrahlrichtung</translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation>LEDs</translation>
    </message>
    <message>
        <source>The probe</source>
        <translation>Der Taster</translation>
    </message>
    <message>
        <source>Ball ±</source>
        <translation>Kugel ±</translation>
    </message>
    <message>
        <source>Tip ±</source>
        <translation>Kugelmitte ±</translation>
    </message>
    <message>
        <source>LEDs ±</source>
        <translation>LEDs ±</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>Licht</translation>
    </message>
    <message>
        <source>The axis of an orientation rule</source>
        <translation>Die Achse einer Lageregel</translation>
    </message>
    <message>
        <source>The direction of an orientation rule</source>
        <translation>Die Richtung einer Lageregel</translation>
    </message>
    <message>
        <source>Frame of the strobe code</source>
        <translation>Bild des Blitzcodes</translation>
    </message>
    <message>
        <source>Enter LED and ball positions. LED ambiguity is checked as you type. Then choose the new document in Settings (Instrument) and calibrate the probe.</source>
        <translation>Positionen von LEDs und Kugel eingeben. Ob LEDs zu verwechseln sind, wird dabei geprüft. Dann das neue Dokument in den Einstellungen (Gerät) wählen und den Taster kalibrieren.</translation>
    </message>
    <message>
        <source>Define a probe</source>
        <translation>Taster definieren</translation>
    </message>
    <message>
        <source>Read the probe document from the file</source>
        <translation>Tasterdokument aus Datei lesen</translation>
    </message>
    <message>
        <source>File of the probe document</source>
        <translation>Datei des Tasterdokuments</translation>
    </message>
    <message>
        <source>Back; unsaved changes are lost</source>
        <translation>Zurück; ungespeicherte Änderungen gehen verloren</translation>
    </message>
    <message>
        <source>Start from another document</source>
        <translation>Von einem anderen Dokument ausgehen</translation>
    </message>
    <message>
        <source>As measured</source>
        <translation>Wie gemessen</translation>
    </message>
    <message>
        <source>Use the LEDs of the active calibration</source>
        <translation>LEDs der aktiven Kalibrierung nehmen</translation>
    </message>
    <message>
        <source>Add LED</source>
        <translation>LED anfügen</translation>
    </message>
    <message>
        <source>Add an LED, copying the last one</source>
        <translation>LED anfügen, als Kopie der letzten</translation>
    </message>
    <message>
        <source>Remove LED</source>
        <translation>LED entfernen</translation>
    </message>
    <message>
        <source>Remove the selected LED</source>
        <translation>Ausgewählte LED entfernen</translation>
    </message>
    <message>
        <source>Save as a new document</source>
        <translation>Als neues Dokument speichern</translation>
    </message>
    <message>
        <source>EXAMINING</source>
        <translation>WIRD GEPRÜFT</translation>
    </message>
    <message>
        <source>GOOD</source>
        <translation>GUT</translation>
    </message>
    <message>
        <source>CANNOT BE USED</source>
        <translation>NICHT NUTZBAR</translation>
    </message>
    <message>
        <source>SAVED</source>
        <translation>GESPEICHERT</translation>
    </message>
    <message>
        <source>Probe saved in {path}.</source>
        <translation>Taster gespeichert in {path}.</translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: each is dark in a different frame.</source>
        <translation>Die LEDs sind nicht zu verwechseln: jede ist in einem anderen Bild dunkel.</translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: the orientation rules exclude every other order.</source>
        <translation>Die LEDs sind nicht zu verwechseln: die Lageregeln schließen jede andere Zuordnung aus.</translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: the nearest wrong order, {order}, misses by {residual_mm:.1f} mm; it would put the tip {tip_error_mm:.0f} mm off.</source>
        <translation>Die LEDs sind nicht zu verwechseln: die nächste falsche Zuordnung, {order}, liegt {residual_mm:.1f} mm daneben; sie würde die Kugelmitte um {tip_error_mm:.0f} mm versetzen.</translation>
    </message>
    <message>
        <source>With {hidden} hidden, the nearest wrong order misses by {residual_mm:.1f} mm.</source>
        <translation>Ist {hidden} verdeckt, liegt die nächste falsche Zuordnung {residual_mm:.1f} mm daneben.</translation>
    </message>
    <message>
        <source>coordinate in the frame of the probe document</source>
        <translation>Koordinate im System des Tasterdokuments</translation>
    </message>
    <message>
        <source>This, mm</source>
        <translation>Diese, mm</translation>
    </message>
    <message>
        <source>this calibration</source>
        <translation>diese Kalibrierung</translation>
    </message>
    <message>
        <source>2nd, µm</source>
        <translation>2., µm</translation>
    </message>
    <message>
        <source>second minus first sweep</source>
        <translation>zweiter minus erster Schwenk</translation>
    </message>
    <message>
        <source>expanded uncertainty of that difference (k = 2)</source>
        <translation>erweiterte Unsicherheit dieser Differenz (k = 2)</translation>
    </message>
    <message>
        <source>Spheres, µm</source>
        <translation>Kugeln, µm</translation>
    </message>
    <message>
        <source>mean of the sphere centres (thesis 3.2), minus this</source>
        <translation>Mittel der Kugelmitten (Dissertation 3.2) minus diese</translation>
    </message>
    <message>
        <source>Change, µm</source>
        <translation>Änderung, µm</translation>
    </message>
    <message>
        <source>this minus the active calibration</source>
        <translation>diese minus die aktive Kalibrierung</translation>
    </message>
    <message>
        <source>in the frame of the probe document</source>
        <translation>im System des Tasterdokuments</translation>
    </message>
    <message>
        <source>second sweep from first</source>
        <translation>zweiter Schwenk zum ersten</translation>
    </message>
    <message>
        <source>against the active calibration</source>
        <translation>zur aktiven Kalibrierung</translation>
    </message>
    <message>
        <source>Before and after</source>
        <translation>Vorher und nachher</translation>
    </message>
    <message>
        <source>What changes</source>
        <translation>Was sich ändert</translation>
    </message>
    <message>
        <source>The tip compared</source>
        <translation>Vergleich der Kugelmitte</translation>
    </message>
    <message>
        <source>The LEDs compared</source>
        <translation>Vergleich der LEDs</translation>
    </message>
    <message>
        <source>LED sphere centres scatter {spread:.1f} µm (RMS) about their mean.</source>
        <translation>Die Kugelmitten der LEDs streuen {spread:.1f} µm (RMS) um ihr Mittel.</translation>
    </message>
    <message>
        <source>Paths</source>
        <translation>Bahnen</translation>
    </message>
    <message>
        <source>Before/after</source>
        <translation>Vorher/nachher</translation>
    </message>
    <message>
        <source>The tip moved by {tip_distance:.3f} mm. Why?</source>
        <translation>Die Kugelmitte hat sich um {tip_distance:.3f} mm bewegt. Warum?</translation>
    </message>
    <message>
        <source>TIP CHANGED</source>
        <translation>TASTSPITZE VERÄNDERT</translation>
    </message>
    <message>
        <source>The tip has moved by {tip_distance:.3f} mm. Accept only if you know why; you will be asked for the reason.</source>
        <translation>Die Kugelmitte hat sich um {tip_distance:.3f} mm bewegt. Nur annehmen, wenn die Ursache bekannt ist; sie wird erfragt.</translation>
    </message>
    <message>
        <source>USABLE, CHECK</source>
        <translation>BRAUCHBAR, PRÜFEN</translation>
    </message>
    <message>
        <source>The calibration can be used, but with reservations; see below.</source>
        <translation>Die Kalibrierung ist nutzbar, aber mit Vorbehalten; siehe unten.</translation>
    </message>
    <message>
        <source>Noise</source>
        <translation>Rauschen</translation>
    </message>
    <message>
        <source>field of the document of the tracker</source>
        <translation>Feld im Dokument des Trackers</translation>
    </message>
    <message>
        <source>in force until now, or of the document</source>
        <translation>bisher gültig, oder aus dem Dokument</translation>
    </message>
    <message>
        <source>in force after accepting</source>
        <translation>gültig nach dem Übernehmen</translation>
    </message>
    <message>
        <source>Noise of the tracker</source>
        <translation>Rauschen des Trackers</translation>
    </message>
    <message numerus="yes">
        <source>%n places</source>
        <comment>1 place</comment>
        <translation>
            <numerusform>%n Stelle</numerusform>
            <numerusform>%n Stellen</numerusform>
        </translation>
    </message>
    <message>
        <source>Both sweeps give the same tip. After accepting, qualify the tip on the sphere.</source>
        <translation>Beide Schwenkläufe ergeben dieselbe Kugelmitte. Nach dem Annehmen die Tastspitze an der Kugel einmessen.</translation>
    </message>
    <message>
        <source>first</source>
        <translation>erster</translation>
    </message>
    <message>
        <source>second</source>
        <translation>zweiter</translation>
    </message>
    <message>
        <source>2nd sweep</source>
        <translation>2. Schwenk</translation>
    </message>
    <message>
        <source>{distance} away</source>
        <translation>{distance} entfernt</translation>
    </message>
    <message>
        <source>Poses</source>
        <translation>Lagen</translation>
    </message>
    <message>
        <source>{used}, {left_out} left out</source>
        <translation>{used}, {left_out} ausgelassen</translation>
    </message>
    <message>
        <source>chi² / dof</source>
        <translation>Chi² / FG</translation>
    </message>
    <message>
        <source>Articulation</source>
        <translation>Beweglichkeit</translation>
    </message>
    <message>
        <source>tip {axis}</source>
        <translation>Kugelmitte {axis}</translation>
    </message>
    <message>
        <source>First calibration of this tip: nothing to compare with.</source>
        <translation>Erste Kalibrierung dieser Tastspitze: nichts zum Vergleichen.</translation>
    </message>
    <message>
        <source>Since the calibration of {when} the tip moved by {tip_distance:.4f} mm and the LEDs by {led_rms:.4f} mm (RMS).</source>
        <translation>Seit der Kalibrierung vom {when} hat sich die Kugelmitte um {tip_distance:.4f} mm und haben sich die LEDs um {led_rms:.4f} mm (RMS) bewegt.</translation>
    </message>
    <message>
        <source>Probe attitudes</source>
        <translation>Stellungen des Tasters</translation>
    </message>
    <message>
        <source>{name} {poses} of {wanted}</source>
        <translation>{name} {poses} von {wanted}</translation>
    </message>
    <message>
        <source>done</source>
        <translation>fertig</translation>
    </message>
    <message>
        <source>Volume shown</source>
        <translation>Gezeigtes Volumen</translation>
    </message>
    <message>
        <source>Uncertainty of a length</source>
        <translation>Unsicherheit einer Länge</translation>
    </message>
    <message>
        <source>Missing: {cells}</source>
        <translation>Es fehlen: {cells}</translation>
    </message>
    <message>
        <source>Nothing is missing</source>
        <translation>Nichts fehlt</translation>
    </message>
    <message>
        <source>Bar placements</source>
        <translation>Lagen des Maßstabs</translation>
    </message>
    <message>
        <source>A suitable next bar placement</source>
        <translation>Eine geeignete nächste Lage des Maßstabs</translation>
    </message>
    <message>
        <source>All taken</source>
        <translation>Alle aufgenommen</translation>
    </message>
    <message>
        <source>Points of the world frame</source>
        <translation>Punkte des Weltsystems</translation>
    </message>
    <message>
        <source>of {length_mm:.0f} mm (k = 2); {limit:.1f} µm is enough</source>
        <translation>für {length_mm:.0f} mm (k = 2); {limit:.1f} µm genügen</translation>
    </message>
    <message numerus="yes">
        <source>%n poses of {wanted}</source>
        <comment>1 pose of {wanted}</comment>
        <translation>
            <numerusform>%n Lage von {wanted}</numerusform>
            <numerusform>%n Lagen von {wanted}</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>{taken} of %n points taken</source>
        <comment>{taken} of 1 point taken</comment>
        <translation>
            <numerusform>{taken} von %n Punkt aufgenommen</numerusform>
            <numerusform>{taken} von %n Punkten aufgenommen</numerusform>
        </translation>
    </message>
    <message>
        <source>The world fixed to the cameras.</source>
        <translation>Die Welt fest mit den Kameras.</translation>
    </message>
    <message>
        <source>Origin: (0, 0, 0)</source>
        <translation>Ursprung: (0, 0, 0)</translation>
    </message>
    <message>
        <source>On X: the X axis passes through it</source>
        <translation>Auf X: die X-Achse geht hindurch</translation>
    </message>
    <message>
        <source>In XY: on the side of positive Y</source>
        <translation>In XY: auf der Seite von +Y</translation>
    </message>
    <message>
        <source>Points touched</source>
        <translation>Angetastete Punkte</translation>
    </message>
    <message>
        <source>nothing to touch</source>
        <translation>nichts anzutasten</translation>
    </message>
    <message>
        <source>of {length_mm:.0f} mm; too early to tell</source>
        <translation>von {length_mm:.0f} mm; noch zu früh</translation>
    </message>
    <message>
        <source>placement {number}</source>
        <translation>Lage {number}</translation>
    </message>
    <message>
        <source>which camera</source>
        <translation>welche Kamera</translation>
    </message>
    <message>
        <source>Shift mm</source>
        <translation>Versatz mm</translation>
    </message>
    <message>
        <source>shift of its centre, common motion removed</source>
        <translation>Versatz ihrer Mitte, ohne gemeinsame Bewegung</translation>
    </message>
    <message>
        <source>Turn mrad</source>
        <translation>Drehung mrad</translation>
    </message>
    <message>
        <source>rotation, common motion removed</source>
        <translation>Drehung, ohne gemeinsame Bewegung</translation>
    </message>
    <message>
        <source>focal length, after minus before</source>
        <translation>Brennweite, nachher minus vorher</translation>
    </message>
    <message>
        <source>principal point, after minus before</source>
        <translation>Bildhauptpunkt, nachher minus vorher</translation>
    </message>
    <message>
        <source>Changes of the cameras</source>
        <translation>Änderungen der Kameras</translation>
    </message>
    <message>
        <source>Points of the volume, after minus before</source>
        <translation>Punkte des Volumens, nachher minus vorher</translation>
    </message>
    <message>
        <source>First calibration of these cameras: nothing to compare with.</source>
        <translation>Erste Kalibrierung dieser Kameras: nichts zum Vergleichen.</translation>
    </message>
    <message>
        <source>All cameras together moved by {moved_mm:.3f} mm and rotated by {turned_rad:.3f} mrad; the remaining change of each camera is below. U of a length (k = 2): {before} before, {after} after.</source>
        <translation>Alle Kameras zusammen haben sich um {moved_mm:.3f} mm verschoben und um {turned_rad:.3f} mrad gedreht; die übrige Änderung jeder Kamera steht unten. U einer Länge (k = 2): {before} vorher, {after} nachher.</translation>
    </message>
    <message>
        <source>Sensors</source>
        <translation>Sensoren</translation>
    </message>
    <message>
        <source>Histogram</source>
        <translation>Histogramm</translation>
    </message>
    <message>
        <source>U {before} before, {after} after (k = 2)</source>
        <translation>U {before} vorher, {after} nachher (k = 2)</translation>
    </message>
    <message>
        <source>Space</source>
        <translation>Leertaste</translation>
    </message>
    <message>
        <source>No objections to this calibration. After accepting, verify it.</source>
        <translation>Keine Einwände gegen diese Kalibrierung. Nach dem Annehmen verifizieren.</translation>
    </message>
    <message>
        <source>no points held back</source>
        <translation>keine Punkte zurückgehalten</translation>
    </message>
    <message>
        <source>Used</source>
        <translation>Genutzt</translation>
    </message>
    <message numerus="yes">
        <source>%n positions, {held} more held back</source>
        <comment>1 position, {held} more held back</comment>
        <translation>
            <numerusform>%n Stelle, {held} weitere zurückgehalten</numerusform>
            <numerusform>%n Stellen, {held} weitere zurückgehalten</numerusform>
        </translation>
    </message>
    <message>
        <source>Left out</source>
        <translation>Ausgelassen</translation>
    </message>
    <message>
        <source>Focal length</source>
        <translation>Brennweite</translation>
    </message>
    <message>
        <source>Errors RMS</source>
        <translation>RMS-Abweichung</translation>
    </message>
    <message>
        <source>Length</source>
        <translation>Länge</translation>
    </message>
    <message>
        <source>Where to touch the sphere</source>
        <translation>Wo die Kugel anzutasten ist</translation>
    </message>
    <message numerus="yes">
        <source>{title}: %n points</source>
        <comment>{title}: 1 point</comment>
        <translation>
            <numerusform>{title}: %n Punkt</numerusform>
            <numerusform>{title}: %n Punkte</numerusform>
        </translation>
    </message>
    <message>
        <source>Points on spheres</source>
        <translation>Punkte auf Kugeln</translation>
    </message>
    <message>
        <source>No sphere chosen: press Next.</source>
        <translation>Keine Kugel gewählt: „Weiter“ drücken.</translation>
    </message>
    <message>
        <source>Sphere {number} of {count}: {taken} of {sphere_points}</source>
        <translation>Kugel {number} von {count}: {taken} von {sphere_points}</translation>
    </message>
    <message>
        <source>Leaning</source>
        <translation>Neigen</translation>
    </message>
    <message>
        <source>Leaning the other way</source>
        <translation>In die andere Richtung neigen</translation>
    </message>
    <message>
        <source>Turning the handle</source>
        <translation>Am Griff drehen</translation>
    </message>
    <message>
        <source>Ball in the cone: keep it there.</source>
        <translation>Kugel im Kegelsitz: dort lassen.</translation>
    </message>
    <message>
        <source>Sweep</source>
        <translation>Schwenk</translation>
    </message>
    <message>
        <source>Directions of the probe</source>
        <translation>Richtungen des Tasters</translation>
    </message>
    <message>
        <source>Rotation of the probe</source>
        <translation>Drehung des Tasters</translation>
    </message>
    <message>
        <source>(k = 2); {wanted:.0f} µm is enough</source>
        <translation>(k = 2); {wanted:.0f} µm genügen</translation>
    </message>
    <message>
        <source>too early to tell</source>
        <translation>noch zu früh</translation>
    </message>
    <message>
        <source>Attitudes</source>
        <translation>Stellungen</translation>
    </message>
    <message>
        <source>First cone again</source>
        <translation>Nochmals erster Kegelsitz</translation>
    </message>
    <message>
        <source>Directions of the first sweep</source>
        <translation>Richtungen des ersten Schwenks</translation>
    </message>
    <message>
        <source>The first cone again</source>
        <translation>Nochmals der erste Kegelsitz</translation>
    </message>
    <message>
        <source>COMPLETE</source>
        <translation>VOLLSTÄNDIG</translation>
    </message>
    <message>
        <source>Nothing is missing.</source>
        <translation>Nichts fehlt.</translation>
    </message>
    <message>
        <source>BACK INTO THE FIRST CONE</source>
        <translation>ZURÜCK IN DEN ERSTEN KEGELSITZ</translation>
    </message>
    <message>
        <source>held as at the start</source>
        <translation>gehalten wie am Anfang</translation>
    </message>
    <message>
        <source>STARTS IN {seconds}</source>
        <translation>BEGINNT IN {seconds}</translation>
    </message>
    <message>
        <source>SWEEP</source>
        <translation>SCHWENKEN</translation>
    </message>
    <message>
        <source>BALL LEFT THE CONE</source>
        <translation>KUGEL HAT DEN KEGELSITZ VERLASSEN</translation>
    </message>
    <message>
        <source>BALL INTO THE CONE</source>
        <translation>KUGEL IN DEN KEGELSITZ</translation>
    </message>
    <message>
        <source>Away from the first</source>
        <translation>Weg vom ersten</translation>
    </message>
    <message>
        <source>Check</source>
        <translation>Prüfung</translation>
    </message>
    <message>
        <source>quantity checked</source>
        <translation>geprüfte Größe</translation>
    </message>
    <message>
        <source>value found</source>
        <translation>gefundener Wert</translation>
    </message>
    <message>
        <source>expanded uncertainty (k = 2)</source>
        <translation>erweiterte Unsicherheit (k = 2)</translation>
    </message>
    <message>
        <source>Limit, µm</source>
        <translation>Grenze, µm</translation>
    </message>
    <message>
        <source>of the error</source>
        <translation>der Abweichung</translation>
    </message>
    <message>
        <source>quantity compared</source>
        <translation>verglichene Größe</translation>
    </message>
    <message>
        <source>Now</source>
        <translation>Jetzt</translation>
    </message>
    <message>
        <source>this qualification</source>
        <translation>dieses Einmessen</translation>
    </message>
    <message>
        <source>Before</source>
        <translation>Vorher</translation>
    </message>
    <message>
        <source>previous qualification</source>
        <translation>voriges Einmessen</translation>
    </message>
    <message>
        <source>now minus before</source>
        <translation>jetzt minus vorher</translation>
    </message>
    <message>
        <source>Errors in numbers</source>
        <translation>Abweichungen in Zahlen</translation>
    </message>
    <message numerus="yes">
        <source>%n points, form {form:.1f} µm</source>
        <comment>1 point, form {form:.1f} µm</comment>
        <translation>
            <numerusform>%n Punkt, Form {form:.1f} µm</numerusform>
            <numerusform>%n Punkte, Form {form:.1f} µm</numerusform>
        </translation>
    </message>
    <message>
        <source>Largest error</source>
        <translation>Größte Abweichung</translation>
    </message>
    <message numerus="yes">
        <source>{form_mm:.1f} µm, %n points</source>
        <comment>{form_mm:.1f} µm, 1 point</comment>
        <translation>
            <numerusform>{form_mm:.1f} µm, %n Punkt</numerusform>
            <numerusform>{form_mm:.1f} µm, %n Punkte</numerusform>
        </translation>
    </message>
    <message>
        <source>angle from the pole</source>
        <translation>Winkel vom Pol</translation>
    </message>
    <message>
        <source>Now and before</source>
        <translation>Jetzt und vorher</translation>
    </message>
    <message>
        <source>PASSED</source>
        <translation>BESTANDEN</translation>
    </message>
    <message>
        <source>Store the verdict; points can then be taken with this tip. Certificate: Ctrl+P in Maintain, page Probe.</source>
        <translation>Ergebnis speichern; danach können mit dieser Tastspitze Punkte aufgenommen werden. Kalibrierschein: Strg+P in Wartung, Seite Taster.</translation>
    </message>
    <message>
        <source>Clean ball, sphere and cone, tighten the stylus and qualify again. If it fails again, calibrate the probe or change the stylus.</source>
        <translation>Tastkugel, Kugel und Kegelsitz reinigen, Taststift festziehen und nochmals einmessen. Besteht sie wieder nicht, Taster kalibrieren oder Taststift wechseln.</translation>
    </message>
    <message>
        <source>Diameter</source>
        <translation>Durchmesser</translation>
    </message>
    <message>
        <source>In the cone</source>
        <translation>Im Kegelsitz</translation>
    </message>
    <message>
        <source>Largest</source>
        <translation>Größte</translation>
    </message>
    <message>
        <source>The tip is still as qualified. Store the verdict and continue. A check does not extend the term of the qualification, whose certificate is at Ctrl+P in Maintain, page Probe.</source>
        <translation>Die Tastspitze ist noch wie eingemessen. Ergebnis speichern und weiterarbeiten. Eine Prüfung verlängert die Frist des Einmessens nicht; dessen Kalibrierschein: Strg+P in Wartung, Seite Taster.</translation>
    </message>
    <message>
        <source>The tip is no longer as qualified. Store the verdict: no points are taken until the tip is qualified or the probe calibrated.</source>
        <translation>Die Tastspitze ist nicht mehr wie eingemessen. Urteil speichern: es werden keine Punkte aufgenommen, bis sie eingemessen oder der Taster kalibriert ist.</translation>
    </message>
    <message>
        <source>2s in the cone, µm</source>
        <translation>2s im Kegelsitz, µm</translation>
    </message>
    <message>
        <source>Largest in the cone, µm</source>
        <translation>Größte im Kegelsitz, µm</translation>
    </message>
    <message>
        <source>Point, µm</source>
        <translation>Punkt, µm</translation>
    </message>
    <message>
        <source>Temperature, °C</source>
        <translation>Temperatur, °C</translation>
    </message>
    <message>
        <source>Made</source>
        <translation>Datum</translation>
    </message>
    <message>
        <source>Touch</source>
        <translation>Antasten</translation>
    </message>
    <message>
        <source>Places on the sphere, seen from its pole</source>
        <translation>Stellen auf der Kugel, vom Pol gesehen</translation>
    </message>
    <message>
        <source>Diameter of the ball</source>
        <translation>Durchmesser der Kugel</translation>
    </message>
    <message>
        <source>Coverage of the sphere</source>
        <translation>Abdeckung der Kugel</translation>
    </message>
    <message>
        <source>TOUCH</source>
        <translation>ANTASTEN</translation>
    </message>
    <message>
        <source>{nominal_mm:.4f} expected</source>
        <translation>{nominal_mm:.4f} erwartet</translation>
    </message>
    <message>
        <source>Places</source>
        <translation>Stellen</translation>
    </message>
    <message>
        <source>U of the diameter (k = 2)</source>
        <translation>U des Durchmessers (k = 2)</translation>
    </message>
    <message>
        <source>… with all places</source>
        <translation>… mit allen Stellen</translation>
    </message>
    <message>
        <source>Hold</source>
        <translation>Halten</translation>
    </message>
    <message>
        <source>Spread of the tip (2 s)</source>
        <translation>Streuung der Kugelmitte (2 s)</translation>
    </message>
    <message>
        <source>at most {limit:.1f} µm</source>
        <translation>höchstens {limit:.1f} µm</translation>
    </message>
    <message>
        <source>after two attitudes</source>
        <translation>nach zwei Stellungen</translation>
    </message>
    <message>
        <source>Tips about their mean</source>
        <translation>Kugelmitten um ihr Mittel</translation>
    </message>
    <message>
        <source>largest {largest:.1f} µm</source>
        <translation>größte {largest:.1f} µm</translation>
    </message>
    <message>
        <source>none yet</source>
        <translation>noch keine</translation>
    </message>
    <message>
        <source>HOLD STILL  {seconds_left:.1f}</source>
        <translation>STILLHALTEN  {seconds_left:.1f}</translation>
    </message>
    <message>
        <source>Taken automatically.</source>
        <translation>Automatisch aufgenommen.</translation>
    </message>
    <message>
        <source>Press Space to take it.</source>
        <translation>Leertaste drücken, um aufzunehmen.</translation>
    </message>
    <message>
        <source>READY</source>
        <translation>BEREIT</translation>
    </message>
    <message>
        <source>TAKEN</source>
        <translation>AUFGENOMMEN</translation>
    </message>
    <message>
        <source>Next: {where}</source>
        <translation>Nächstes: {where}</translation>
    </message>
    <message>
        <source>one more point, as shown on the map</source>
        <translation>noch ein Punkt, wie auf der Karte gezeigt</translation>
    </message>
    <message>
        <source>{failed} of {checks} failed</source>
        <translation>{failed} von {checks} nicht bestanden</translation>
    </message>
    <message>
        <source>Error</source>
        <translation>Abweichung</translation>
    </message>
    <message>
        <source>Store the verdict; the calibration can then be used. Certificate: Ctrl+P in Maintain, page Calibration.</source>
        <translation>Ergebnis speichern; danach kann die Kalibrierung verwendet werden. Kalibrierschein: Strg+P in Wartung, Seite Kalibrierung.</translation>
    </message>
    <message>
        <source>A line was repeated and the verification failed: store it and calibrate again.</source>
        <translation>Eine Linie wurde wiederholt und die Verifikation nicht bestanden: speichern und neu kalibrieren.</translation>
    </message>
    <message>
        <source>If only one line failed, repeat it once. If it fails again, store the verdict and calibrate again. Jobs since the last good verification are then suspect: Recall jobs (F12), on page Calibration, shows which of their verdicts hold.</source>
        <translation>Hat nur eine Linie nicht bestanden, sie einmal neu messen. Besteht sie wieder nicht, das Urteil speichern und neu kalibrieren. Aufträge seit der letzten guten Verifikation sind dann fraglich: der Rückruf (F12) auf der Seite „Kalibrierung“ zeigt, welche ihrer Urteile gelten.</translation>
    </message>
    <message>
        <source>Since</source>
        <translation>Seit</translation>
    </message>
    <message>
        <source>First</source>
        <translation>Zuerst</translation>
    </message>
    <message>
        <source>Figures and reasons</source>
        <translation>Zahlen und Gründe</translation>
    </message>
    <message>
        <source>Of the room; empty: the thermometer is read</source>
        <translation>Des Raums; leer: das Thermometer wird ausgelesen</translation>
    </message>
    <message>
        <source>Thermometer U, K</source>
        <translation>Thermometer U, K</translation>
    </message>
    <message>
        <source>U (k = 2), K, or its id in the register</source>
        <translation>U (k = 2), K, oder Kennung im Verzeichnis</translation>
    </message>
    <message>
        <source>{ended} Press Esc to leave.</source>
        <translation>{ended} Esc drücken, um zu verlassen.</translation>
    </message>
    <message>
        <source>No result to accept; see the reason and remedy above.</source>
        <translation>Kein Ergebnis zum Annehmen; Grund und Abhilfe siehe oben.</translation>
    </message>
    <message>
        <source>Nothing to accept yet: calculate the result first.</source>
        <translation>Noch nichts zum Annehmen: zuerst das Ergebnis berechnen.</translation>
    </message>
    <message>
        <source>Complete: continuing.</source>
        <translation>Vollständig: es geht weiter.</translation>
    </message>
    <message>
        <source>Next is ready: press Return.</source>
        <translation>„Weiter“ ist bereit: Eingabe drücken.</translation>
    </message>
    <message>
        <source>Next is locked: {reason} {remedy}</source>
        <translation>„Weiter“ ist gesperrt: {reason} {remedy}</translation>
    </message>
    <message>
        <source>The session</source>
        <translation>Die Sitzung</translation>
    </message>
    <message numerus="yes">
        <source>%n spots</source>
        <comment>1 spot</comment>
        <translation>
            <numerusform>%n Lichtpunkt</numerusform>
            <numerusform>%n Lichtpunkte</numerusform>
        </translation>
    </message>
    <message>
        <source>Camera view</source>
        <translation>Kamerabild</translation>
    </message>
    <message>
        <source>Seen now</source>
        <translation>Jetzt zu sehen</translation>
    </message>
    <message>
        <source>What to do now</source>
        <translation>Was jetzt zu tun ist</translation>
    </message>
    <message>
        <source>Press Return for the next step.</source>
        <translation>Eingabetaste: nächster Schritt.</translation>
    </message>
    <message>
        <source>WAIT</source>
        <translation>WARTEN</translation>
    </message>
    <message>
        <source>{text} {frames} of {wanted} frames.</source>
        <translation>{text} {frames} von {wanted} Bildern.</translation>
    </message>
    <message>
        <source>Accept the new</source>
        <translation>Neue annehmen</translation>
    </message>
    <message>
        <source>Activate this calibration?</source>
        <translation>Diese Kalibrierung in Kraft setzen?</translation>
    </message>
    <message>
        <source>End and keep the old calibration?</source>
        <translation>Beenden und die alte Kalibrierung behalten?</translation>
    </message>
    <message>
        <source>Store the verdict</source>
        <translation>Urteil speichern</translation>
    </message>
    <message>
        <source>Discard</source>
        <translation>Verwerfen</translation>
    </message>
    <message>
        <source>Store this verdict?</source>
        <translation>Dieses Urteil speichern?</translation>
    </message>
    <message>
        <source>End without a verdict?</source>
        <translation>Ohne Urteil beenden?</translation>
    </message>
    <message>
        <source>PRACTICE: {title}</source>
        <translation>ÜBUNG: {title}</translation>
    </message>
    <message>
        <source>Where to go</source>
        <translation>Wohin</translation>
    </message>
    <message>
        <source>complete</source>
        <translation>vollständig</translation>
    </message>
    <message>
        <source>Select the next point</source>
        <translation>Nächsten Punkt wählen</translation>
    </message>
    <message>
        <source>Nests taken</source>
        <translation>Aufgenommene Kugelaufnahmen</translation>
    </message>
    <message>
        <source>all lines taken</source>
        <translation>alle Linien aufgenommen</translation>
    </message>
    <message>
        <source>Seats visited</source>
        <translation>Besuchte Plätze</translation>
    </message>
    <message>
        <source>both seats visited</source>
        <translation>beide Plätze besucht</translation>
    </message>
    <message>
        <source>Recorded</source>
        <translation>Aufgenommen</translation>
    </message>
    <message numerus="yes">
        <source>Recorded places: %n</source>
        <translation>
            <numerusform>Aufgenommene Stellen: %n</numerusform>
            <numerusform>Aufgenommene Stellen: %n</numerusform>
        </translation>
    </message>
    <message>
        <source>seat {number}</source>
        <translation>Platz {number}</translation>
    </message>
    <message>
        <source>cameras</source>
        <translation>Kameras</translation>
    </message>
    <message>
        <source>nest {done}</source>
        <translation>Aufnahme {done}</translation>
    </message>
    <message numerus="yes">
        <source>%n reference points</source>
        <comment>1 reference point</comment>
        <translation>
            <numerusform>%n Referenzpunkt</numerusform>
            <numerusform>%n Referenzpunkte</numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n measuring lines</source>
        <comment>1 measuring line</comment>
        <translation>
            <numerusform>%n Messlinie</numerusform>
            <numerusform>%n Messlinien</numerusform>
        </translation>
    </message>
    <message>
        <source>Volume in front of the cameras</source>
        <translation>Volumen vor den Kameras</translation>
    </message>
    <message>
        <source>Deviations from the recommended plan</source>
        <translation>Abweichungen vom empfohlenen Plan</translation>
    </message>
    <message>
        <source>Begun</source>
        <translation>Begonnen</translation>
    </message>
    <message>
        <source>{wanted} wanted</source>
        <translation>{wanted} gewünscht</translation>
    </message>
    <message>
        <source>Session file</source>
        <translation>Sitzungsdatei</translation>
    </message>
    <message>
        <source>Picture of the probe</source>
        <translation>Bild des Tasters</translation>
    </message>
    <message numerus="yes">
        <source>%n LEDs</source>
        <comment>1 LED</comment>
        <translation>
            <numerusform>%n LED</numerusform>
            <numerusform>%n LEDs</numerusform>
        </translation>
    </message>
    <message>
        <source>no LEDs yet</source>
        <translation>noch keine LEDs</translation>
    </message>
    <message>
        <source>ball</source>
        <translation>Kugel</translation>
    </message>
    <message>
        <source>Plots</source>
        <translation>Diagramme</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>Ergebnis</translation>
    </message>
    <message>
        <source>Result of the calculation</source>
        <translation>Ergebnis der Berechnung</translation>
    </message>
    <message>
        <source>Figures of the result</source>
        <translation>Zahlen des Ergebnisses</translation>
    </message>
    <message>
        <source>Objections</source>
        <translation>Einwände</translation>
    </message>
    <message>
        <source>No plots yet</source>
        <translation>Noch keine Diagramme</translation>
    </message>
    <message>
        <source>Calculating …</source>
        <translation>Wird berechnet …</translation>
    </message>
    <message>
        <source>No result to show</source>
        <translation>Kein Ergebnis zum Zeigen</translation>
    </message>
    <message>
        <source>CALCULATING  {calculating_s:.0f} s</source>
        <translation>RECHNET  {calculating_s:.0f} s</translation>
    </message>
    <message>
        <source>Window and session stay as they are; C cancels the calculation.</source>
        <translation>Fenster und Sitzung bleiben, wie sie sind; C bricht die Berechnung ab.</translation>
    </message>
    <message>
        <source>NO RESULT</source>
        <translation>KEIN ERGEBNIS</translation>
    </message>
    <message>
        <source>Instrument</source>
        <translation>Gerät</translation>
    </message>
    <message>
        <source>Temperature</source>
        <translation>Temperatur</translation>
    </message>
    <message>
        <source>Report head</source>
        <translation>Berichtskopf</translation>
    </message>
    <message>
        <source>Live stream</source>
        <translation>Live-Datenstrom</translation>
    </message>
    <message>
        <source>Measuring programs</source>
        <translation>Messprogramme</translation>
    </message>
    <message>
        <source>Window</source>
        <translation>Fenster</translation>
    </message>
    <message>
        <source>Document of the probe</source>
        <translation>Dokument des Tasters</translation>
    </message>
    <message>
        <source>Name of the mounted tip; empty: as its records say</source>
        <translation>Name der montierten Tastspitze; leer: laut Protokollen</translation>
    </message>
    <message>
        <source>Reference body</source>
        <translation>Referenzkörper</translation>
    </message>
    <message>
        <source>LEDs fixed to the part; empty: none</source>
        <translation>LEDs am Werkstück; leer: keine</translation>
    </message>
    <message>
        <source>Camera records</source>
        <translation>Kameraprotokolle</translation>
    </message>
    <message>
        <source>Folder of calibrations; empty: of this user</source>
        <translation>Ordner der Kalibrierungen; leer: dieses Benutzers</translation>
    </message>
    <message>
        <source>Tip records</source>
        <translation>Tastspitzenprotokolle</translation>
    </message>
    <message>
        <source>Folder of probe and tip records; empty: of this user</source>
        <translation>Ordner der Taster- und Tastspitzenprotokolle; leer: dieses Benutzers</translation>
    </message>
    <message>
        <source>Check the tip after</source>
        <translation>Tastspitze prüfen nach</translation>
    </message>
    <message>
        <source>Hours without a point or a check</source>
        <translation>Stunden ohne Punkt oder Prüfung</translation>
    </message>
    <message>
        <source>Processor of the bus</source>
        <translation>Prozessor des Busses</translation>
    </message>
    <message>
        <source>For the camera bus, 0 first; empty: any</source>
        <translation>Für den Kamerabus, ab 0; leer: beliebig</translation>
    </message>
    <message>
        <source>Job folder</source>
        <translation>Auftragsordner</translation>
    </message>
    <message>
        <source>Where jobs and reports are written</source>
        <translation>Wohin Aufträge und Berichte geschrieben werden</translation>
    </message>
    <message>
        <source>Second job folder</source>
        <translation>Zweiter Auftragsordner</translation>
    </message>
    <message>
        <source>For jobs whose file was removed, moved or replaced; empty: data folder of the user</source>
        <translation>Für Aufträge, deren Datei gelöscht, verschoben oder ersetzt wurde; leer: Datenordner des Benutzers</translation>
    </message>
    <message>
        <source>Plan folder</source>
        <translation>Prüfplanordner</translation>
    </message>
    <message>
        <source>Released plans only</source>
        <translation>Nur freigegebene Pläne</translation>
    </message>
    <message>
        <source>Refuse plans that are not released, or were changed after the release</source>
        <translation>Pläne ablehnen, die nicht freigegeben oder danach geändert sind</translation>
    </message>
    <message>
        <source>Proposed for a new job</source>
        <translation>Vorschlag für einen neuen Auftrag</translation>
    </message>
    <message>
        <source>Users</source>
        <translation>Benutzer</translation>
    </message>
    <message>
        <source>Names proposed as operator, parted by semicolons</source>
        <translation>Als Bediener vorgeschlagene Namen, durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Part temperature</source>
        <translation>Werkstücktemperatur</translation>
    </message>
    <message>
        <source>Measured today; empty: unknown</source>
        <translation>Heute gemessen; leer: unbekannt</translation>
    </message>
    <message>
        <source>Part expansion</source>
        <translation>Ausdehnung des Werkstücks</translation>
    </message>
    <message>
        <source>Empty: by the material of the plan</source>
        <translation>Leer: nach dem Werkstoff im Plan</translation>
    </message>
    <message>
        <source>Compensate the part</source>
        <translation>Werkstück kompensieren</translation>
    </message>
    <message>
        <source>Report coordinates at 20 °C</source>
        <translation>Koordinaten bei 20 °C angeben</translation>
    </message>
    <message>
        <source>Probe temperature</source>
        <translation>Tastertemperatur</translation>
    </message>
    <message>
        <source>Document of its materials: growth and bending</source>
        <translation>Dokument seiner Werkstoffe: Wachsen und Biegen</translation>
    </message>
    <message>
        <source>Compensate the probe</source>
        <translation>Taster kompensieren</translation>
    </message>
    <message>
        <source>Use its geometry at its temperature</source>
        <translation>Seine Geometrie bei seiner Temperatur nutzen</translation>
    </message>
    <message>
        <source>Standard uncertainty</source>
        <translation>Standardunsicherheit</translation>
    </message>
    <message>
        <source>Of each temperature</source>
        <translation>Jeder Temperatur</translation>
    </message>
    <message>
        <source>Thermometer</source>
        <translation>Thermometer</translation>
    </message>
    <message>
        <source>Instead: its U (k = 2) in K, or its id in the register</source>
        <translation>Stattdessen: sein U (k = 2) in K oder seine Kennung im Register</translation>
    </message>
    <message>
        <source>Temperatures hold for</source>
        <translation>Temperaturen gelten für</translation>
    </message>
    <message>
        <source>Older ones are not used: measure again</source>
        <translation>Ältere werden nicht genutzt: neu messen</translation>
    </message>
    <message>
        <source>Over every report</source>
        <translation>Über jedem Bericht</translation>
    </message>
    <message>
        <source>Address</source>
        <translation>Adresse</translation>
    </message>
    <message>
        <source>Lines, parted by semicolons</source>
        <translation>Zeilen, durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Logo</source>
        <translation>Logo</translation>
    </message>
    <message>
        <source>PNG or JPEG</source>
        <translation>PNG oder JPEG</translation>
    </message>
    <message>
        <source>Contact</source>
        <translation>Kontakt</translation>
    </message>
    <message>
        <source>Telephone, mail or page</source>
        <translation>Telefon, E-Mail oder Webseite</translation>
    </message>
    <message>
        <source>Accreditation</source>
        <translation>Akkreditierung</translation>
    </message>
    <message>
        <source>Number of the laboratory; empty: none</source>
        <translation>Nummer des Labors; leer: keine</translation>
    </message>
    <message>
        <source>Country</source>
        <translation>Land</translation>
    </message>
    <message>
        <source>Two capital letters, for digital certificates</source>
        <translation>Zwei Großbuchstaben, für digitale Zertifikate</translation>
    </message>
    <message>
        <source>polyworks; qif; dfq; xlsx; json; fai; cloud; points; pdf: written together, parted by semicolons</source>
        <translation>polyworks; qif; dfq; xlsx; json; fai; cloud; points; pdf: zusammen geschrieben, durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Edition of I++ DME</source>
        <translation>Ausgabe von I++ DME</translation>
    </message>
    <message>
        <source>The one that the measuring program speaks</source>
        <translation>Diejenige, die das Messprogramm verwendet</translation>
    </message>
    <message>
        <source>Other computers must be on the list below</source>
        <translation>Andere Rechner müssen in der Liste darunter stehen</translation>
    </message>
    <message>
        <source>TCP port of the measuring program</source>
        <translation>TCP-Port für das Messprogramm</translation>
    </message>
    <message>
        <source>Permitted computers</source>
        <translation>Zugelassene Rechner</translation>
    </message>
    <message>
        <source>Addresses or networks, parted by semicolons</source>
        <translation>Adressen oder Netze, durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Sign of the shift</source>
        <translation>Vorzeichen der Verschiebung</translation>
    </message>
    <message>
        <source>X0, Y0, Z0: origin of the part, or offset added after the rotation</source>
        <translation>X0, Y0, Z0: Ursprung des Werkstücks, oder nach der Drehung addierter Versatz</translation>
    </message>
    <message>
        <source>origin</source>
        <translation>Ursprung</translation>
    </message>
    <message>
        <source>Point that is sent</source>
        <translation>Gesendeter Punkt</translation>
    </message>
    <message>
        <source>ball: its centre; surface: compensated, with radius 0</source>
        <translation>Kugel: ihr Mittelpunkt; Oberfläche: korrigiert, mit Radius 0</translation>
    </message>
    <message>
        <source>surface</source>
        <translation>Oberfläche</translation>
    </message>
    <message>
        <source>The one that the tablet reaches, or 0.0.0.0 for all; 127.0.0.1: this one only</source>
        <translation>Die für das Tablet erreichbare, oder 0.0.0.0 für alle; 127.0.0.1: nur dieser Computer</translation>
    </message>
    <message>
        <source>TCP port of the page for a tablet or phone</source>
        <translation>TCP-Port der Seite für Tablet oder Telefon</translation>
    </message>
    <message>
        <source>Buttons</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>The page can undo, finish and choose; in a network only with the certificate</source>
        <translation>Die Seite kann zurücknehmen, abschließen und wählen; im Netz nur mit dem Zertifikat</translation>
    </message>
    <message>
        <source>By a ruler; empty: as stated by the screen</source>
        <translation>Mit dem Lineal gemessen; leer: wie vom Bildschirm gemeldet</translation>
    </message>
    <message>
        <source>Machine</source>
        <translation>Maschine</translation>
    </message>
    <message>
        <source>simulated, ethercat:INTERFACE, ethercat:service, genicam:SERIAL,SERIAL, a tracker (igtl:, natnet:, ndi:, qtm:) or replay:FILE</source>
        <translation>simulated, ethercat:SCHNITTSTELLE, ethercat:service, genicam:NUMMER,NUMMER, ein Tracker (igtl:, natnet:, ndi:, qtm:) oder replay:DATEI</translation>
    </message>
    <message>
        <source>Document of the cameras or of the tracker</source>
        <translation>Dokument der Kameras oder des Trackers</translation>
    </message>
    <message>
        <source>Name of the measuring machine</source>
        <translation>Name der Messmaschine</translation>
    </message>
    <message>
        <source>Its serial number</source>
        <translation>Seriennummer</translation>
    </message>
    <message>
        <source>Of the measuring machine</source>
        <translation>Der Messmaschine</translation>
    </message>
    <message>
        <source>Its inventory number</source>
        <translation>Inventarnummer</translation>
    </message>
    <message>
        <source>As the laboratory calls it</source>
        <translation>Wie das Labor sie nennt</translation>
    </message>
    <message>
        <source>Signatures</source>
        <translation>Unterschriften</translation>
    </message>
    <message>
        <source>Below the lines, 1 to 3, parted by semicolons</source>
        <translation>Unter den Linien, 1 bis 3, durch Semikolon getrennt</translation>
    </message>
    <message>
        <source>Formats of E</source>
        <translation>Formate von E</translation>
    </message>
    <message>
        <source>Report template; empty: the plain one</source>
        <translation>Berichtsvorlage; leer: die einfache</translation>
    </message>
    <message>
        <source>Report language</source>
        <translation>Sprache der Berichte</translation>
    </message>
    <message>
        <source>Of reports on paper; window: that of the window</source>
        <translation>Von Berichten auf Papier; Fenster: die des Fensters</translation>
    </message>
    <message>
        <source>window</source>
        <translation>Fenster</translation>
    </message>
    <message>
        <source>Unit of reports</source>
        <translation>Einheit der Berichte</translation>
    </message>
    <message>
        <source>Of reports on paper and workbooks; window: that of the window</source>
        <translation>Der Berichte auf Papier und Arbeitsmappen; Fenster: die des Fensters</translation>
    </message>
    <message>
        <source>Port</source>
        <translation>Port</translation>
    </message>
    <message>
        <source>Points and poses for other programs; empty: off</source>
        <translation>Punkte und Lagen für andere Programme; leer: aus</translation>
    </message>
    <message>
        <source>Address of this computer</source>
        <translation>Adresse dieses Rechners</translation>
    </message>
    <message>
        <source>Other computers need a token</source>
        <translation>Andere Rechner brauchen ein Token</translation>
    </message>
    <message>
        <source>Token</source>
        <translation>Token</translation>
    </message>
    <message>
        <source>File with the token, readable by you alone</source>
        <translation>Datei mit dem Token, nur für den Eigentümer lesbar</translation>
    </message>
    <message>
        <source>PEM; the stream then speaks TLS</source>
        <translation>PEM; der Datenstrom spricht dann TLS</translation>
    </message>
    <message>
        <source>Private key</source>
        <translation>Privater Schlüssel</translation>
    </message>
    <message>
        <source>PEM, of that certificate</source>
        <translation>PEM, zu diesem Zertifikat</translation>
    </message>
    <message>
        <source>Name of this station</source>
        <translation>Name dieser Station</translation>
    </message>
    <message>
        <source>In the archive; empty: the name of this computer</source>
        <translation>Im Archiv; leer: der Name dieses Rechners</translation>
    </message>
    <message>
        <source>Password</source>
        <translation>Passwort</translation>
    </message>
    <message>
        <source>File that only you can read</source>
        <translation>Datei, die nur Sie lesen können</translation>
    </message>
    <message>
        <source>Language</source>
        <translation>Sprache</translation>
    </message>
    <message>
        <source>Of all sentences; system: that of the computer</source>
        <translation>Aller Sätze; System: die des Rechners</translation>
    </message>
    <message>
        <source>system</source>
        <translation>System</translation>
    </message>
    <message>
        <source>Decimal sign</source>
        <translation>Dezimalzeichen</translation>
    </message>
    <message>
        <source>On screen; locale: that of the language</source>
        <translation>Am Bildschirm; Sprache: das der Sprache</translation>
    </message>
    <message>
        <source>locale</source>
        <translation>Sprache</translation>
    </message>
    <message>
        <source>Import of a table</source>
        <translation>Import einer Tabelle</translation>
    </message>
    <message>
        <source>What the reader makes of the table</source>
        <translation>Wie die Tabelle gelesen wird</translation>
    </message>
    <message>
        <source>First and last lines</source>
        <translation>Erste und letzte Zeilen</translation>
    </message>
    <message>
        <source>Unit of lengths</source>
        <translation>Längeneinheit</translation>
    </message>
    <message>
        <source>as in the file, else mm</source>
        <translation>wie in der Datei, sonst mm</translation>
    </message>
    <message>
        <source>Columns</source>
        <translation>Spalten</translation>
    </message>
    <message>
        <source>as in the heading; {example}</source>
        <translation>wie in der Kopfzeile; {example}</translation>
    </message>
    <message>
        <source>Take the table over</source>
        <translation>Die Tabelle übernehmen</translation>
    </message>
    <message>
        <source>Go back without the table</source>
        <translation>Zurück ohne die Tabelle</translation>
    </message>
    <message>
        <source>Lines to skip</source>
        <translation>Auszulassende Zeilen</translation>
    </message>
    <message>
        <source>none; 3: first three, 4-9: range</source>
        <translation>keine; 3: die ersten drei, 4-9: Bereich</translation>
    </message>
    <message>
        <source>point</source>
        <translation>Punkt</translation>
    </message>
    <message>
        <source>comma</source>
        <translation>Komma</translation>
    </message>
    <message>
        <source>by the numbers</source>
        <translation>nach den Zahlen</translation>
    </message>
    <message>
        <source>Sign before the decimals</source>
        <translation>Zeichen vor den Dezimalen</translation>
    </message>
    <message>
        <source>Line</source>
        <translation>Zeile</translation>
    </message>
    <message>
        <source>Left out, because</source>
        <translation>Ausgelassen, weil</translation>
    </message>
    <message>
        <source>not read</source>
        <translation>nicht gelesen</translation>
    </message>
    <message numerus="yes">
        <source>%n lines between them are not shown.</source>
        <comment>1 line between them is not shown.</comment>
        <translation>
            <numerusform>%n Zeile dazwischen ist nicht gezeigt.</numerusform>
            <numerusform>%n Zeilen dazwischen sind nicht gezeigt.</numerusform>
        </translation>
    </message>
    <message>
        <source>Unit of length</source>
        <translation>Längeneinheit</translation>
    </message>
    <message>
        <source>inch</source>
        <translation>Zoll</translation>
    </message>
    <message>
        <source>Folder searched for plans; empty: recent places only</source>
        <translation>Ordner, in dem Prüfpläne gesucht werden; leer: nur zuletzt benutzte Orte</translation>
    </message>
    <message>
        <source>Place of measurement, unless a job states another</source>
        <translation>Ort der Messung, sofern kein Auftrag einen anderen nennt</translation>
    </message>
    <message>
        <source>Place: local, off, a file, or a PostgreSQL database; without password</source>
        <translation>Ort: local, off, eine Datei oder eine PostgreSQL-Datenbank; ohne Passwort</translation>
    </message>
    <message>
        <source>On screen; files for programs are in mm</source>
        <translation>Auf dem Bildschirm; Dateien für Programme sind in mm</translation>
    </message>
    <message>
        <source>Colours of the window</source>
        <translation>Farben des Fensters</translation>
    </message>
    <message>
        <source>dark</source>
        <translation>dunkel</translation>
    </message>
    <message>
        <source>light</source>
        <translation>hell</translation>
    </message>
    <message>
        <source>contrast</source>
        <translation>Kontrast</translation>
    </message>
    <message>
        <source>Zoom</source>
        <translation>Vergrößerung</translation>
    </message>
    <message>
        <source>Of the size that fits the screen; Ctrl + and Ctrl - change it</source>
        <translation>Der Größe, die zum Bildschirm passt; Strg + und Strg - ändern sie</translation>
    </message>
    <message>
        <source>Buttons and rows of at least 15 mm on this screen</source>
        <translation>Tasten und Zeilen von mindestens 15 mm auf diesem Bildschirm</translation>
    </message>
    <message>
        <source>Length of the line below</source>
        <translation>Länge der Linie darunter</translation>
    </message>
    <message>
        <source>Sounds</source>
        <translation>Töne</translation>
    </message>
    <message>
        <source>Play sounds</source>
        <translation>Töne abspielen</translation>
    </message>
    <message>
        <source>Of all sounds; Test of sounds plays them</source>
        <translation>Aller Töne; Töne anhören spielt sie</translation>
    </message>
    <message>
        <source>Far view first</source>
        <translation>Zuerst Fernansicht</translation>
    </message>
    <message>
        <source>Open jobs in the view for three metres</source>
        <translation>Aufträge in der Ansicht für drei Meter öffnen</translation>
    </message>
    <message>
        <source>Keys that differ from those shipped</source>
        <translation>Tasten, die von den gelieferten abweichen</translation>
    </message>
    <message>
        <source>Answer of the archive</source>
        <translation>Antwort des Archivs</translation>
    </message>
    <message>
        <source>Tour done. Everything you did went the way of a real probe.</source>
        <translation>Rundgang fertig. Alles lief wie mit einem echten Taster.</translation>
    </message>
    <message>
        <source>the part</source>
        <translation>dem Werkstück</translation>
    </message>
    <message>
        <source>Take over is for the virtual rig: this probe is in your hands already.</source>
        <translation>Übernehmen gibt es nur mit virtuellen Kameras: Dieser Taster ist schon in Ihrer Hand.</translation>
    </message>
    <message>
        <source>Choose Demo on the Start page.</source>
        <translation>Auf der Startseite Demo wählen.</translation>
    </message>
    <message>
        <source>Press Take over: the robot gives you the probe.</source>
        <translation>Übernehmen drücken: Der Roboter gibt Ihnen den Taster.</translation>
    </message>
    <message>
        <source>Move the mouse over the part: the ball follows.</source>
        <translation>Maus über das Werkstück bewegen: Die Kugel folgt.</translation>
    </message>
    <message>
        <source>Click on {feature}: the ball touches, and a point is taken.</source>
        <translation>Auf {feature} klicken: Die Kugel tastet an, ein Punkt wird aufgenommen.</translation>
    </message>
    <message>
        <source>Take two more points on {feature}, well apart.</source>
        <translation>Zwei weitere Punkte auf {feature} aufnehmen, weit auseinander.</translation>
    </message>
    <message>
        <source>Press Backspace: the last point is undone, not lost.</source>
        <translation>Rücktaste drücken: Der letzte Punkt wird zurückgenommen, nicht gelöscht.</translation>
    </message>
    <message>
        <source>Press an arrow key: the probe tilts. The cameras must see its LEDs.</source>
        <translation>Pfeiltaste drücken: Der Taster neigt sich. Die Kameras müssen seine LEDs sehen.</translation>
    </message>
    <message>
        <source>Press F3: the results, and how sure they are.</source>
        <translation>F3 drücken: die Ergebnisse und wie sicher sie sind.</translation>
    </message>
    <message>
        <source>Press Esc: back to the part.</source>
        <translation>Esc drücken: zurück zum Werkstück.</translation>
    </message>
    <message>
        <source>Press Hand back: the robot goes on. Ctrl+K finds everything else.</source>
        <translation>Zurückgeben drücken: Der Roboter macht weiter. Strg+K findet alles andere.</translation>
    </message>
    <message>
        <source>Drawing the first page</source>
        <translation>Die erste Seite wird gezeichnet</translation>
    </message>
    <message>
        <source>Preview of the report template</source>
        <translation>Vorschau der Berichtsvorlage</translation>
    </message>
    <message>
        <source>State of the preview</source>
        <translation>Zustand der Vorschau</translation>
    </message>
    <message>
        <source>First page of a report</source>
        <translation>Erste Seite eines Berichts</translation>
    </message>
    <message>
        <source>First page of a report, nothing measured. It follows the settings.</source>
        <translation>Erste Seite eines Berichts, nichts gemessen. Sie folgt den Einstellungen.</translation>
    </message>
    <message>
        <source>Coach</source>
        <translation>Coach</translation>
    </message>
    <message>
        <source>U {value} µm</source>
        <translation>U {value} µm</translation>
    </message>
    <message numerus="yes">
        <source>Camera {name} sees %n LEDs.</source>
        <comment>Camera {name} sees 1 LED.</comment>
        <translation>
            <numerusform>Kamera {name} sieht %n LED.</numerusform>
            <numerusform>Kamera {name} sieht %n LEDs.</numerusform>
        </translation>
    </message>
    <message>
        <source>Ellipsoid of the ball, k = 2: {axes} µm.</source>
        <translation>Ellipsoid der Kugel, k = 2: {axes} µm.</translation>
    </message>
    <message>
        <source>ring {scale} µm</source>
        <translation>Ring {scale} µm</translation>
    </message>
    <message>
        <source>{turns}: U {now} → {then} µm</source>
        <translation>{turns}: U {now} → {then} µm</translation>
    </message>
    <message>
        <source>as you face the cameras</source>
        <translation>mit Blick zu den Kameras</translation>
    </message>
    <message>
        <source>LOST: the cameras do not see the probe</source>
        <translation>VERLOREN: die Kameras sehen den Taster nicht</translation>
    </message>
    <message>
        <source>Turn the LEDs to the cameras. Follow the arrow beside the readout. Move hand, cable and part out of the line of sight. Check that the probe is switched on.</source>
        <translation>LEDs zu den Kameras drehen. Dem Pfeil neben der Anzeige folgen. Hand, Kabel und Werkstück aus der Sichtlinie nehmen. Prüfen, ob der Taster eingeschaltet ist.</translation>
    </message>
    <message>
        <source>LOST: LED identification is ambiguous</source>
        <translation>VERLOREN: die Zuordnung der LEDs ist mehrdeutig</translation>
    </message>
    <message>
        <source>Turn the probe so that all LEDs face both cameras. Cover reflections. Check that the probe in Settings is the one in your hand.</source>
        <translation>Taster drehen, bis alle LEDs zu beiden Kameras zeigen. Reflexionen abdecken. Prüfen, ob der Taster der Einstellungen der in der Hand ist.</translation>
    </message>
    <message>
        <source>INACCURATE: the position uncertainty is too large</source>
        <translation>UNGENAU: die Positionsunsicherheit ist zu groß</translation>
    </message>
    <message>
        <source>Follow the hint beside the readout. Show more LEDs to both cameras. Move the part to the middle of the measuring volume.</source>
        <translation>Dem Hinweis neben der Anzeige folgen. Beiden Kameras mehr LEDs zeigen. Das Werkstück in die Mitte des Messvolumens stellen.</translation>
    </message>
    <message>
        <source>INACCURATE: the spots do not fit the probe</source>
        <translation>UNGENAU: die Lichtpunkte passen nicht zum Taster</translation>
    </message>
    <message>
        <source>Cover reflections and lamps. Check that the right probe is chosen. Look for a bent or knocked probe. If it stays, verify the cameras.</source>
        <translation>Reflexionen und Lampen abdecken. Prüfen, ob der richtige Taster gewählt ist. Nachsehen, ob er verbogen oder angestoßen ist. Bleibt es so, die Kameras verifizieren.</translation>
    </message>
    <message>
        <source>INACCURATE: the ball is outside the calibrated volume</source>
        <translation>UNGENAU: die Kugel ist außerhalb des kalibrierten Volumens</translation>
    </message>
    <message>
        <source>Move the part into the measuring volume; the small picture of the 3-D view shows it.</source>
        <translation>Das Werkstück in das Messvolumen stellen; das kleine Bild der 3-D-Ansicht zeigt es.</translation>
    </message>
    <message>
        <source>No point: the probe moved</source>
        <translation>Kein Punkt: der Taster bewegte sich</translation>
    </message>
    <message>
        <source>Rest the ball on the surface, hold still until the tone, then pull away along the normal. Steady your arm.</source>
        <translation>Kugel auf der Fläche ruhen lassen, bis zum Ton stillhalten, dann entlang der Normalen abheben. Den Arm abstützen.</translation>
    </message>
    <message>
        <source>No point: the side of the material is not known</source>
        <translation>Kein Punkt: die Materialseite ist nicht bekannt</translation>
    </message>
    <message>
        <source>Approach along the normal and pull back the same way. Press I to choose how the side is found, X to flip the last point.</source>
        <translation>Entlang der Normalen antasten und so abheben. I wählt, wie die Seite gefunden wird, X kehrt den letzten Punkt um.</translation>
    </message>
    <message>
        <source>No point: the touch came from another face</source>
        <translation>Kein Punkt: Die Antastung kam von einer anderen Fläche</translation>
    </message>
    <message>
        <source>Touch the feature square to its surface. If its earlier points are wrong, undo them first: Backspace.</source>
        <translation>Das Element senkrecht zu seiner Oberfläche antasten. Wenn seine früheren Punkte falsch sind, diese zuerst rückgängig machen: Rücktaste.</translation>
    </message>
    <message>
        <source>No point: no feature, or several, fit the touch</source>
        <translation>Kein Punkt: kein Element passt zur Antastung, oder mehrere</translation>
    </message>
    <message>
        <source>Choose the feature in the list, or switch to plan order with O. Check the alignment: F5.</source>
        <translation>Element in der Liste wählen oder mit O zur Abfolge des Prüfplans wechseln. Ausrichtung prüfen: F5.</translation>
    </message>
    <message>
        <source>No point: the job is paused</source>
        <translation>Kein Punkt: der Auftrag ist angehalten</translation>
    </message>
    <message>
        <source>Press Z to resume, then touch again.</source>
        <translation>Mit Z fortsetzen, dann erneut antasten.</translation>
    </message>
    <message>
        <source>NO POINTS: the calibration of the cameras forbids it</source>
        <translation>KEINE PUNKTE: die Kalibrierung der Kameras lässt es nicht zu</translation>
    </message>
    <message>
        <source>Read the sentence at the top. Expired or knocked: Maintain, Verify or Relocate. UNCALIBRATED results are not proven.</source>
        <translation>Den Satz ganz oben lesen. Abgelaufen oder angestoßen: Wartung, Verifizieren oder Neu einmessen. Ergebnisse, die UNKALIBRIERT sind, sind nicht nachgewiesen.</translation>
    </message>
    <message>
        <source>NO POINTS: the tip must be checked</source>
        <translation>KEINE PUNKTE: die Spitze muss geprüft werden</translation>
    </message>
    <message>
        <source>Maintain, Check tip: it takes a minute. After a blow or a change of the tip qualify it on the sphere.</source>
        <translation>Wartung, Spitze prüfen: es dauert eine Minute. Nach einem Stoß oder Wechsel die Spitze an der Kugel einmessen.</translation>
    </message>
    <message>
        <source>NOT READY: no new frames from the cameras</source>
        <translation>NICHT BEREIT: keine neuen Bilder von den Kameras</translation>
    </message>
    <message>
        <source>Check power and network cables of the cameras. Maintain, Bus shows which camera is missing. Wait until all are in operation.</source>
        <translation>Strom- und Netzwerkkabel der Kameras prüfen. Wartung, Bus zeigt, welche Kamera fehlt. Warten, bis alle in Betrieb sind.</translation>
    </message>
    <message>
        <source>The reference body is lost or has moved</source>
        <translation>Der Referenzkörper ist verloren oder wurde bewegt</translation>
    </message>
    <message>
        <source>Clear the line of sight to its LEDs. Let part and cameras come to rest. It must not be moved against the part.</source>
        <translation>Sichtlinie zu seinen LEDs freimachen. Werkstück und Kameras zur Ruhe kommen lassen. Er darf gegen das Werkstück nicht bewegt werden.</translation>
    </message>
    <message>
        <source>NOT STORED: points cannot be saved</source>
        <translation>NICHT GESPEICHERT: Punkte lassen sich nicht speichern</translation>
    </message>
    <message>
        <source>Free disk space or connect the disk again. Points that are shown as taken are safe. Open the job again from the Start page.</source>
        <translation>Speicherplatz schaffen oder den Datenträger wieder anschließen. Punkte, die als aufgenommen gezeigt werden, sind sicher. Den Auftrag von der Startseite neu öffnen.</translation>
    </message>
    <message>
        <source>FAILED: a part of the program stopped</source>
        <translation>AUSGEFALLEN: ein Teil des Programms hielt an</translation>
    </message>
    <message>
        <source>All points taken are saved. Open the job again: Start page, Continue. If it fails again, write a support bundle.</source>
        <translation>Alle aufgenommenen Punkte sind gespeichert. Den Auftrag neu öffnen: Startseite, Fortsetzen. Fällt es wieder aus, ein Supportpaket schreiben.</translation>
    </message>
    <message>
        <source>Results: NOT PROVEN</source>
        <translation>Ergebnisse: NICHT NACHGEWIESEN</translation>
    </message>
    <message>
        <source>The value lies within U of the limit. Select it in Results to see what makes U large; more points, or a better attitude of the probe, make it smaller.</source>
        <translation>Der Wert liegt innerhalb von U an der Grenze. In Ergebnisse zeigt die Zeile, was U groß macht; mehr Punkte oder eine bessere Haltung des Tasters machen es kleiner.</translation>
    </message>
    <message>
        <source>The plan cannot be opened</source>
        <translation>Der Prüfplan lässt sich nicht öffnen</translation>
    </message>
    <message>
        <source>Read which line or field the message names. Open the plan in the editor (F4), which marks what is wrong.</source>
        <translation>Lesen, welche Zeile oder welches Feld die Meldung nennt. Den Prüfplan im Editor (F4) öffnen, der markiert, was falsch ist.</translation>
    </message>
    <message>
        <source>A report cannot be written</source>
        <translation>Ein Bericht lässt sich nicht schreiben</translation>
    </message>
    <message>
        <source>Choose a folder that can be written. Close the file in the other program, then press E again.</source>
        <translation>Einen beschreibbaren Ordner wählen. Die Datei im anderen Programm schließen, dann wieder E drücken.</translation>
    </message>
    <message>
        <source>A setting has no effect</source>
        <translation>Eine Einstellung wirkt nicht</translation>
    </message>
    <message>
        <source>Settings shows when a change applies: at once, or when the job is opened again.</source>
        <translation>Die Einstellungen zeigen, wann eine Änderung gilt: sofort, oder wenn der Auftrag neu geöffnet wird.</translation>
    </message>
    <message>
        <source>The archive does not answer</source>
        <translation>Das Archiv antwortet nicht</translation>
    </message>
    <message>
        <source>Nothing is lost: jobs wait in the outbox. Check the network and the address in Settings, Archive.</source>
        <translation>Nichts ist verloren: Aufträge warten im Ausgang. Netzwerk und Adresse prüfen: Einstellungen, Archiv.</translation>
    </message>
    <message>
        <source>The picture stutters or frames are late</source>
        <translation>Das Bild ruckelt oder Bilder kommen zu spät</translation>
    </message>
    <message>
        <source>Close other programs. Let a technician run the doctor of this computer; Maintain, Bus shows late and lost cycles.</source>
        <translation>Andere Programme schließen. Den Rechner von der Instandhaltung prüfen lassen; Wartung, Bus zeigt späte und verlorene Zyklen.</translation>
    </message>
    <message>
        <source>Chapters</source>
        <translation>Kapitel</translation>
    </message>
    <message>
        <source>List of chapters, those for the inspector first</source>
        <translation>Liste der Kapitel, die für den Prüfer zuerst</translation>
    </message>
    <message>
        <source>Search the manual</source>
        <translation>Im Handbuch suchen</translation>
    </message>
    <message>
        <source>Previous place</source>
        <translation>Vorige Stelle</translation>
    </message>
    <message>
        <source>Back to where you read before</source>
        <translation>Zurück zur zuvor gelesenen Stelle</translation>
    </message>
    <message>
        <source>Next place</source>
        <translation>Nächste Stelle</translation>
    </message>
    <message>
        <source>Forward to where you came back from</source>
        <translation>Wieder vor zur Stelle, von der es zurückging</translation>
    </message>
    <message>
        <source>Overview</source>
        <translation>Übersicht</translation>
    </message>
    <message>
        <source>For the inspector</source>
        <translation>Für den Prüfer</translation>
    </message>
    <message>
        <source>For the technician</source>
        <translation>Für die Instandhaltung</translation>
    </message>
    <message>
        <source>For the quality engineer</source>
        <translation>Für die Qualitätssicherung</translation>
    </message>
    <message>
        <source>For the integrator</source>
        <translation>Für die Integration</translation>
    </message>
    <message>
        <source>For developers</source>
        <translation>Für Entwickler</translation>
    </message>
    <message>
        <source>Decisions</source>
        <translation>Entscheidungen</translation>
    </message>
    <message>
        <source>Words to search for</source>
        <translation>Suchwörter</translation>
    </message>
    <message>
        <source>Chapters and what was found</source>
        <translation>Kapitel und Treffer</translation>
    </message>
    <message>
        <source>Language of this page</source>
        <translation>Sprache dieser Seite</translation>
    </message>
    <message>
        <source>Tab and Return follow a link.</source>
        <translation>Tab und Eingabe folgen einem Verweis.</translation>
    </message>
    <message>
        <source>{part}: {title}. Tab and Return follow a link.</source>
        <translation>{part}: {title}. Tab und Eingabe folgen einem Verweis.</translation>
    </message>
    <message>
        <source>This page is in English only.</source>
        <translation>Diese Seite gibt es nur auf Englisch.</translation>
    </message>
    <message>
        <source>The English page was changed after this one was translated.</source>
        <translation>Die englische Seite wurde geändert, nachdem diese übersetzt war.</translation>
    </message>
    <message>
        <source>{link} is not part of the manual.</source>
        <translation>{link} gehört nicht zum Handbuch.</translation>
    </message>
    <message>
        <source>Nothing found: try fewer words, or only their beginnings</source>
        <translation>Nichts gefunden: weniger Wörter oder nur deren Anfang eingeben</translation>
    </message>
    <message>
        <source>Text of the manual</source>
        <translation>Text des Handbuchs</translation>
    </message>
    <message>
        <source>Tab goes to the next link, Return follows it</source>
        <translation>Tab springt zum nächsten Verweis, Eingabe folgt ihm</translation>
    </message>
    <message>
        <source>Glove mode off.</source>
        <translation>Handschuhe: aus.</translation>
    </message>
    <message>
        <source>Glove mode on: targets of 15 mm.</source>
        <translation>Handschuhe: an, Tasten von 15 mm.</translation>
    </message>
    <message>
        <source>Glove mode on, but this screen does not tell its size.</source>
        <translation>Handschuhe: an, doch dieser Bildschirm nennt seine Größe nicht.</translation>
    </message>
    <message>
        <source>Measure the line in Settings, Window: then targets are 15 mm.</source>
        <translation>Linie in Einstellungen, Fenster messen: Dann sind Tasten 15 mm groß.</translation>
    </message>
    <message>
        <source>Zoom {percent} %.</source>
        <translation>Vergrößerung {percent} %.</translation>
    </message>
    <message>
        <source>It is used from the next start.</source>
        <translation>Sie gilt ab dem nächsten Start.</translation>
    </message>
    <message>
        <source>Line to be measured with a ruler</source>
        <translation>Linie, die mit dem Lineal gemessen wird</translation>
    </message>
    <message>
        <source>Measured: {length} mm.</source>
        <translation>Gemessen: {length} mm.</translation>
    </message>
    <message>
        <source>The screen says {length} mm. Measure it if that is wrong.</source>
        <translation>Laut Bildschirm {length} mm. Messen, wenn das falsch ist.</translation>
    </message>
    <message>
        <source>This screen does not tell its size. Measure the line with a ruler.</source>
        <translation>Dieser Bildschirm nennt seine Größe nicht. Linie mit dem Lineal messen.</translation>
    </message>
    <message>
        <source>Point taken</source>
        <translation>Punkt aufgenommen</translation>
    </message>
    <message>
        <source>two short, high, rising</source>
        <translation>zwei kurze, hohe, steigend</translation>
    </message>
    <message>
        <source>A point is in the job. The readout flashes green, the count goes up.</source>
        <translation>Ein Punkt ist im Auftrag. Die Anzeige blinkt grün, die Zahl steigt.</translation>
    </message>
    <message>
        <source>Touch refused</source>
        <translation>Antastung abgelehnt</translation>
    </message>
    <message>
        <source>two low, falling</source>
        <translation>zwei tiefe, fallend</translation>
    </message>
    <message>
        <source>No point was taken. The readout flashes red, the reason stands below it.</source>
        <translation>Kein Punkt aufgenommen. Die Anzeige blinkt rot, der Grund steht darunter.</translation>
    </message>
    <message>
        <source>Wrong face</source>
        <translation>Falsche Fläche</translation>
    </message>
    <message>
        <source>low and up, twice</source>
        <translation>zweimal tief und hinauf</translation>
    </message>
    <message>
        <source>The touch was on another face. No point was taken, the reason stands below.</source>
        <translation>Die Antastung war auf einer anderen Fläche. Es wurde kein Punkt aufgenommen, der Grund steht darunter.</translation>
    </message>
    <message>
        <source>Feature finished</source>
        <translation>Element fertig</translation>
    </message>
    <message>
        <source>three short, rising</source>
        <translation>drei kurze, steigend</translation>
    </message>
    <message>
        <source>Nothing speaks against it. The verdict stands in words with a tick.</source>
        <translation>Nichts spricht dagegen. Das Urteil steht in Worten mit Haken.</translation>
    </message>
    <message>
        <source>In doubt</source>
        <translation>Im Zweifel</translation>
    </message>
    <message>
        <source>three, down and up again</source>
        <translation>drei, tiefer und wieder hoch</translation>
    </message>
    <message>
        <source>Neither conform nor not conform. The verdict stands in words with a triangle.</source>
        <translation>Weder konform noch nicht konform. Das Urteil steht in Worten mit Dreieck.</translation>
    </message>
    <message>
        <source>Not conform</source>
        <translation>Nicht konform</translation>
    </message>
    <message>
        <source>three long, low, the last one lower</source>
        <translation>drei lange, tiefe, der letzte tiefer</translation>
    </message>
    <message>
        <source>Out of tolerance. The verdict stands in words with a cross.</source>
        <translation>Außer Toleranz. Das Urteil steht in Worten mit Kreuz.</translation>
    </message>
    <message>
        <source>Countdown</source>
        <translation>Countdown</translation>
    </message>
    <message>
        <source>two taps</source>
        <translation>zweimal Tippen</translation>
    </message>
    <message>
        <source>A sweep is about to begin. The page counts down.</source>
        <translation>Das Schwenken beginnt gleich. Die Seite zählt herunter.</translation>
    </message>
    <message>
        <source>Sweep begins</source>
        <translation>Schwenken beginnt</translation>
    </message>
    <message>
        <source>one long</source>
        <translation>ein langer</translation>
    </message>
    <message>
        <source>Poses are captured now; the page counts them.</source>
        <translation>Lagen werden jetzt aufgenommen; die Seite zählt sie.</translation>
    </message>
    <message>
        <source>Too fast</source>
        <translation>Zu schnell</translation>
    </message>
    <message>
        <source>three short taps, high</source>
        <translation>dreimal kurz, hoch</translation>
    </message>
    <message>
        <source>The ball slides too fast for points. The next step states its speed.</source>
        <translation>Die Kugel gleitet zu schnell für Punkte. Der nächste Schritt nennt ihre Geschwindigkeit.</translation>
    </message>
    <message>
        <source>Lost contact</source>
        <translation>Kontakt verloren</translation>
    </message>
    <message>
        <source>three short taps, falling</source>
        <translation>dreimal kurz, fallend</translation>
    </message>
    <message>
        <source>The ball is off the surface while it slides. The next step says so.</source>
        <translation>Die Kugel ist beim Gleiten nicht auf der Fläche. Der nächste Schritt nennt es.</translation>
    </message>
    <message>
        <source>Scan complete</source>
        <translation>Scan vollständig</translation>
    </message>
    <message>
        <source>four short, rising</source>
        <translation>viermal kurz, steigend</translation>
    </message>
    <message>
        <source>The ball has covered the scan. The next step states 100 %.</source>
        <translation>Die Kugel hat den Scan erfasst. Der nächste Schritt nennt 100 %.</translation>
    </message>
    <message>
        <source>Approach</source>
        <translation>Annäherung</translation>
    </message>
    <message>
        <source>single short tones, rising</source>
        <translation>einzelne kurze, steigend</translation>
    </message>
    <message>
        <source>The ball comes nearer to the next point. Ring and distance show it; U turns it off.</source>
        <translation>Die Kugel nähert sich dem nächsten Punkt. Ring und Abstand zeigen es; Taste U stellt es ab.</translation>
    </message>
    <message>
        <source>About the sounds</source>
        <translation>Zu den Tönen</translation>
    </message>
    <message>
        <source>Play: {name}</source>
        <translation>Abspielen: {name}</translation>
    </message>
    <message>
        <source>Everything that is heard is seen, too. Volume and off: Window.</source>
        <translation>Was zu hören ist, ist auch zu sehen. Lautstärke und aus: Fenster.</translation>
    </message>
    <message>
        <source>Sounds are off. Turn them on in Window.</source>
        <translation>Töne sind aus. Unter Fenster einschalten.</translation>
    </message>
    <message>
        <source>Nothing is heard: no program that plays sounds was found on this computer.</source>
        <translation>Nichts zu hören: Auf diesem Rechner fand sich kein Programm, das Töne spielt.</translation>
    </message>
    <message>
        <source>a whole number</source>
        <translation>eine ganze Zahl</translation>
    </message>
    <message>
        <source>a number</source>
        <translation>eine Zahl</translation>
    </message>
    <message>
        <source>three numbers separated by spaces</source>
        <translation>drei Zahlen mit Leerzeichen dazwischen</translation>
    </message>
    <message>
        <source>numbers separated by spaces</source>
        <translation>Zahlen mit Leerzeichen dazwischen</translation>
    </message>
    <message>
        <source>two numbers, least and most</source>
        <translation>zwei Zahlen, kleinste und größte</translation>
    </message>
    <message>
        <source>one name and three numbers per line</source>
        <translation>je Zeile ein Name und drei Zahlen</translation>
    </message>
    <message>
        <source>{label} is &apos;{text}&apos;: &apos;{part}&apos; may have thousands or decimals.</source>
        <translation>{label} ist „{text}“: „{part}“ kann Tausender oder Nachkommastellen haben.</translation>
    </message>
    <message>
        <source>Write the number without a sign between thousands.</source>
        <translation>Die Zahl ohne Tausenderzeichen schreiben.</translation>
    </message>
    <message>
        <source>{label} is &apos;{text}&apos;, which is not {wanted}.</source>
        <translation>{label} ist „{text}“; verlangt: {wanted}.</translation>
    </message>
    <message>
        <source>Copy</source>
        <translation>Kopieren</translation>
    </message>
    <message>
        <source>Copy this table, for a message to support</source>
        <translation>Diese Tabelle kopieren, für eine Nachricht an den Support</translation>
    </message>
    <message>
        <source>Licence</source>
        <translation>Lizenz</translation>
    </message>
    <message>
        <source>Show the licence of OCMM</source>
        <translation>Die Lizenz von OCMM zeigen</translation>
    </message>
    <message>
        <source>Third-party</source>
        <translation>Pakete</translation>
    </message>
    <message>
        <source>Show the licences of the packages in OCMM</source>
        <translation>Die Lizenzen der Pakete in OCMM zeigen</translation>
    </message>
    <message>
        <source>Changes</source>
        <translation>Änderungen</translation>
    </message>
    <message>
        <source>Show the changes of this version</source>
        <translation>Die Änderungen dieser Version zeigen</translation>
    </message>
    <message>
        <source>About OCMM</source>
        <translation>Über OCMM</translation>
    </message>
    <message>
        <source>Copied. Paste it into a message to support.</source>
        <translation>Kopiert. In eine Nachricht an den Support einfügen.</translation>
    </message>
    <message>
        <source>property of this program</source>
        <translation>Merkmal dieses Programms</translation>
    </message>
    <message>
        <source>Value</source>
        <translation>Wert</translation>
    </message>
    <message>
        <source>version, licence or folder</source>
        <translation>Version, Lizenz oder Ordner</translation>
    </message>
    <message>
        <source>Text of the licence</source>
        <translation>Text der Lizenz</translation>
    </message>
    <message>
        <source>Done</source>
        <translation>Fertig</translation>
    </message>
    <message>
        <source>Delete last</source>
        <translation>Letzten löschen</translation>
    </message>
    <message>
        <source>Clearance</source>
        <translation>Freifahrpunkt</translation>
    </message>
    <message>
        <source>Send the present position as a clearance point</source>
        <translation>Die aktuelle Position als Freifahrpunkt senden</translation>
    </message>
    <message>
        <source>No touch</source>
        <translation>Nicht antastbar</translation>
    </message>
    <message>
        <source>Report the element as complete</source>
        <translation>Das Element als vollständig melden</translation>
    </message>
    <message>
        <source>Delete your last point, here and in the program</source>
        <translation>Ihren letzten Punkt löschen, hier und im Programm</translation>
    </message>
    <message>
        <source>Report that this point cannot be touched</source>
        <translation>Melden, dass dieser Punkt nicht angetastet werden kann</translation>
    </message>
    <message>
        <source>Server for measuring programs</source>
        <translation>Server für Messprogramme</translation>
    </message>
    <message>
        <source>Address and program</source>
        <translation>Adresse und Programm</translation>
    </message>
    <message>
        <source>Last command and answer</source>
        <translation>Letzter Befehl und Antwort</translation>
    </message>
    <message>
        <source>Disconnect the program and end the server</source>
        <translation>Das Programm trennen und den Server beenden</translation>
    </message>
    <message>
        <source>Stop server</source>
        <translation>Server beenden</translation>
    </message>
    <message>
        <source>{title} at {address}.</source>
        <translation>{title} auf {address}.</translation>
    </message>
    <message>
        <source>No program is connected.</source>
        <translation>Kein Programm verbunden.</translation>
    </message>
    <message>
        <source>Program at {client}.</source>
        <translation>Programm auf {client}.</translation>
    </message>
</context>
</TS>
