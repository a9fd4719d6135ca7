<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de_DE">
<context>
    <name></name>
    <message>
        <source>Id</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What tests call it, such as BAR-1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the artefact</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Maker</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>May be empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Serial no.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As engraved</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Laboratory</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>That calibrated it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its number</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Due</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Holds until, like 2027-06-30: your own rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sizes, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>At 20 °C: diameter; or nests of a bar from 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>k = 2</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U per length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part that grows with length; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Form, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Certified form error; empty if within U</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Expansion, 1/K</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Such as 1.15e-5</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>its u, 1/K</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty, such as 1e-6</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Held</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where and how it is held; may be empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Quantity</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of a DCC with several lengths: part of its name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Artefact</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Kind</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What the artefact is</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>New</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Empty the fields</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Read DCC</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fill in from a digital certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add to the register</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Renew</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fill in the selected one, for a new certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take the selected one out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop reading</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What tests call it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What it is</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Number and laboratory</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Holds until</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Refused for</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Procedures that cannot use it; select it for the reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Artefacts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Register of artefacts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why the selected artefact is refused</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Read the certificate from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the DCC</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Read</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove the artefact</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stored: {id}, due {due}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove {id} from the register?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>nothing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no test</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n artefacts</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>{count} in the register. Nothing is overwritten.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Removed: {id}. Its lines stay in the file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Read. Give an id and a due date, then store (F8).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Acceptance test</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Is the instrument as good as it says: a standard test with its verdict.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verdict stored. P writes the certificate.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Unfinished tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing was changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Retest</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Retest
[N]</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n positions</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Points taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Last error against its limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why something is measured again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Position</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Room, °C</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Type it when it changes, then Return</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>all points taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Position {number} of {count}: {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No errors yet: they follow when a position is complete.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Last: {quantity} {error:+.1f} µm, limit ± {limit:.1f} µm
{name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Procedure</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Title of the procedure</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard and edition that it is modelled on</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Needs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Artefact that it needs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Min</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Minutes for a trained person</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Done by</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Your name, for the record</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Temperature of the room, as measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Place</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where the test is made; may be empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Customer</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>For whom; empty for the laboratory itself</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>as found</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>after adjustment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Procedures</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limits of the procedure</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About the artefact</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Condition</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>State of the machine</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why it cannot start</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start  [Return]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start the test</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Resume  [G]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Resume the selected test</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leave  [Esc]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back to Maintain</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading unfinished tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{title}, {who}: {done} of {wanted} points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, {serial}, due {due}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No artefact in the register suits. Add one: F9 in Maintain.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U {um:.2f} µm (k = 2)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not finished</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>bar</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>gauge block</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>plate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>dumbbell</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>cone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{wording}; rule: {rule}; limits: {limits}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Draw plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Draw the order and blind codes, and store them</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the plan of a study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose the folder of the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Progress</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Which measurement comes next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Analyse</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Gauge R&amp;R of every characteristic</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Type 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cg and Cgk of the selected characteristic</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop the analysis</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name; also the batch of its jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>STUDY-1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Parts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How many</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Operators</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Names, parted by commas</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Trials</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of each operator on each part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The order is drawn from it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reference, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Certified value, for type 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Characteristic</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As in the inspection plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>GRR, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard deviation, with its 90 % interval</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>% study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>GRR of the whole variation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>% tol.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>6 GRR of the tolerance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ndc</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Distinct categories</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Own U</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Scatter found over the uncertainty that is stated</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>AIAG: 10 and 30 %, ndc 5</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Gauge study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Analysing the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store the plan in the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jobs of the study in</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Use</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Progress of the study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is to be told of the study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Characteristics</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Components</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>By operator</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Draw a plan (F6) or open one (F7). The codes are the serial numbers of jobs.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan stored in {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Analysing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: {parts} parts, {operators} operators, {trials} trials</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{simulated}{name}: least tolerance {width:.4f} mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED. </source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>CAPABLE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NOT CAPABLE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{done} of {count} measured.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Complete: analyse it (F8).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next: operator {who}, part {part}; serial number {code}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{n} files left out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{simulated}{done} of {count} measured. {left}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO STUDY</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No plan is open.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Draw one (F6) or open it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the whole test</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ended</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Local time</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Who</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As entered</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Worst</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The value that is nearest to its limit or farthest beyond</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Number of the record</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About the tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Acceptance tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The list of tests</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n tests</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n not finished: F7 resumes</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>SIMULATED: virtual rig. {said}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{quantity} {error:+.1f} of {limit:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED {verdict}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where to touch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{title}: point {next} of {count}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is tested</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Position and length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Error, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Test value</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the test value, k = 2</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>MPE, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>By the decision rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Source</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Meaning of the verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Figures of the verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Every value</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Errors and limits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Interim checks</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Certificate (PDF and DCC)  [P]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the certificate, PDF and DCC</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record  [2]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show every value of the record</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source> (repeated)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{error:+.1f} ± {u:.1f} µm, limit {limit:.1f}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Retests left</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Method</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED: virtual rig and artefact</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO VERDICT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NOT CALCULATED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press R to calculate.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>OCMM

Starting: {source}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>worst {worst_us:.0f}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{least:.1f} to {most:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{least:.1f} to {most:.1f} µm; hatched: not seen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>nothing seen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>across: {across}   up: {up}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bending</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>design not known</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>marks: LEDs; dashed: hand</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>sag, held level / nm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>1 N on the ball / nm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Errors, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>largest: {error_mm:+.1f} µm ± {expanded_mm:.1f}, limit {limit_mm:.1f} ({name})</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Interim checks, error in µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no checks yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} checks, last {error:+.1f} µm: {word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>centre</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>+3 s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>-3 s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip of every frame, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RMS {axes}; {left_out} left out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>frames of both sweeps</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Residuals of the spots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>arrows: means</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n spots, {left_out} left out</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Residuals on the sensors</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Residuals, px</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RMS {sigma:.4f} px, {beyond} of {count} beyond 3 sigma ({expected:.0f} expected)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RMS {axes} µm, largest {worst:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>from the front</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>from above</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} of {total} directions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>▼ cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>nothing yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Components, % of study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no study</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>GRR</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeatability (EV)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Operators (AV)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Parts (PV)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>, {p:.1f} % of tolerance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>GRR {p:.1f} % of study{tolerance}, ndc {ndc}: {word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Value less part mean, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>largest difference of operators {um:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviation, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>N {n}, Cg {cg:.2f} ({low:.2f} to {high:.2f}), Cgk {cgk:.2f}: {word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tolerance bar</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no tolerance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: deviation {deviation} mm, limits {lower} to {upper} mm, {verdict}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Paths of the LEDs about the ball</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{poses} poses, {leds} LEDs; drag to rotate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Trend over the parts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mean</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>UCL</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LCL</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: no parts included</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: {count} parts, {least:.4f} to {most:.4f}, {signals} signals</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Files</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Path</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Path of the file; Return opens it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recent places</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Files of the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose this folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading {folder}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>↑ Folder above</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n files.</source>
        <comment>1 file.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>The first {count} are shown; type the path of others.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{path}: not there, or not what is looked for.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Find an action</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What do you want to do?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What do you want to do? Return does it, Esc closes.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Actions that fit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keys</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Actions and their keys</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About the chosen key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose an action and press Change; a foot switch is set up likewise.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Change</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Default key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{key} leaves and walks through pages.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{key} is already {action}. Choose another key, or change that one first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{action} is now on {key}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The default key is now {action}. Change that one first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press the new key of {action}. Esc keeps the old one.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The key was not changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press the new key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Waiting for a key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Other file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look for another plan file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Go on with this plan: who measures which part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>New job: choose the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plans</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the plans</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>shipped with OCMM</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, part {part}
{where}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Return or F8 goes on with the selected plan.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About {setting}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look for the file of {setting}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Set {setting} to its default</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Yes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Differs from the default</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Given at the start, which wins until OCMM is closed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Default: {default}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Set for this station.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Set for this user only.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Used when the job is opened.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Return takes it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>as shipped</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Use now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the job again with these settings; no point is lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Settings</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What was not used</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Used from the next opening of the job: {names}. F8 opens it again now.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n settings differ from the default (●).</source>
        <comment>1 setting differs from the default (●).</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>New job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose a plan and measure a part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Continue</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Go on with the selected job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look at a job, or measure by a plan file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Create or edit a plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras, probe and tip: state and procedures</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Demo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED: a robot hand measures a virtual part, to look and learn</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras, probe, folders, temperatures, sounds, keys</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Theme</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Switch between dark, light and high contrast</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Quit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close OCMM</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start page</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What to do first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the records of cameras and tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Last jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down select a job; Return goes on with it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About {what}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras are SIMULATED: choose real ones in Settings, or try the Demo.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ready. New job begins with the plan; Continue goes on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No points can be taken yet: Calibrate shows what is missing.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No jobs in {folder} yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Station</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{sentence} Due on {date}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: cannot be read, {when}
{why}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>all features finished</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no points yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>paused, {done} of {all} features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{done} of {all} features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{part}, serial {serial}: {state}
{when}, {operator}, {points} points, {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a job to look at it, or a plan to measure by it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan of the new job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Inspect</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Maintain</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take a point now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Undo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Undo the last point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Finish</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Finish this feature and go to the next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Flip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Flip the last point to the other side</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Previous</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show the previous feature of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show the next feature of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Skip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Skip this feature; it can be measured later</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeat</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeat this feature; its old points stay in the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reopen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reopen a finished or skipped feature to add points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Order</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Switch between plan order and any order</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Side</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Change how the probe side is found</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pause</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pause or resume</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Redo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Redo the last undone step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the next point of the feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Previous point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the previous point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Delete point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Delete the selected point and give a reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Restore</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Restore the deleted point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Turn the approach tone on or off</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Refit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculate all results from the raw data</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Operator, serial number, next part, unfinished jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Results</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All characteristics, their uncertainty and the reports</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Alignment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Alignment: residuals and free axes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Far view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Switch between far view and desk view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show or hide the live camera images</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fit view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Zoom the 3-D view to the whole part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close-up</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Zoom the 3-D view to the active feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part look</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show the part shaded, as hidden lines or transparent</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Export</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the report files</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bus report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the bus report as text, for support</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate the cameras from known points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Relocate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalibrate the cameras in place, with the probe and a length bar</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verify</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verify the calibration with independent artefacts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write to cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store the intrinsics of the calibration in the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculate older jobs whose calibration later failed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrate probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Find tip and LED positions: pivot the probe with its ball in a cone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Qualify tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Find the ball diameter on a certified sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Check tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One-minute check that the tip is still as qualified</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Mount tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Confirm tip change</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Define</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Define a new probe document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard tests with limits and a verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Interim check</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>90 seconds: is the system still as it was</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Register of spheres, bars, blocks and parts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Measurement system analysis from jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the certificate of what this page shows, PDF and DCC</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All keyboard shortcuts of the window</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Home</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leave the job for the Start page; no point is lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Find</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Type what you want to do</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save log</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save the message log, for support</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Switch between Inspect and Maintain</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Question</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{verb}  [Return]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back  [Esc]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{verb} anyway</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancel and go back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part and cameras have moved {moved_mm:.1f} mm and {turned_rad:.2f}° relative to each other since the job started. Points follow the reference body &apos;{name}&apos;.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n outliers.</source>
        <comment>1 outlier.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Outliers: {named}. Still used in the fit. Delete to exclude.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Selected: {point}. Del deletes it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Point {numbers} deleted. Ins restores it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>point {number}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>point {number} ({residual} mm)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PAUSED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the job again: Start page, Continue.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Paused. Press Z to resume.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} is done. Press F6 to reopen it, PgDown to go on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} is skipped. Press F6 to reopen it, PgDown to go on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select and measure what is missing, or press E to write the report.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All features measured. Press E to write the report.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Touch any feature; it is identified by position.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} has all its points. Press Return to finish it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>Next: touch %n points on {name}.</source>
        <comment>Next: touch one point on {name}.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>Touch %n more points on {name}.</source>
        <comment>Touch one more point on {name}.</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>serial {serial}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>order {order}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>batch {batch}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan order</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Any order</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{order}. Side: {side}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{distance:.0f} mm to the next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>about {distance:.0f} mm to the next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>approach direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>pull away after the touch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>along the shank</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>as the plan says</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No point: {what} {remedy}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ACTIVE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>OPEN</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SKIPPED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>DONE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO TOLERANCE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No characteristics in the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No messages.
</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Notice</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Notice text</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Dismiss  [Esc]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Dismiss this message</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Browse</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Look for the file or folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close without changes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>missed the surface</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Delete a point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reason for deletion</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Delete</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Delete the point now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Close without deleting</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reason for deleting point {number}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back to measuring; nothing is lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>About this page</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{reached} of {count} reached</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Corners</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeats</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Form</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{error_mm:.1f} µm, limit {limit_mm:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: progress</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stopped; nothing was changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>F9 stops.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Failed; the previous result is still shown.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>frames taken from all cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>frames lost: sent by a camera, not received</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recoveries</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>number of recoveries to operation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stray answers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>late, duplicate or out-of-order answers, discarded</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Objects done</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>transfers of camera objects</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Objects failed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>transfers of camera objects that failed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cycle</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>time from one exchange to the next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>time from one exposure to the next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Phase of the bus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bus fault</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cycle starts late, µs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Round trip, µs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cycle to bus clock, µs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Drift, ppm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Clocks, ns</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Notes on the privileges of the bus process</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why no data are shown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove the cause, then open the job again.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The time of this virtual bus waits for this computer: no cycle is late.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>On this computer: {names}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n older events were dropped.</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>ENDED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>These are the last values.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO REPORT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No report from the bus process for {age_s:.0f} s.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>These are its last values. If this persists, open the job again.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{minutes:.1f} minutes, {good:.3f} % of the cycles good, no frames lost.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{minutes:.1f} minutes, {good:.3f} % of the cycles good, {lost} frames lost.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name in the rig document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Serial</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Serial number</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Position on the bus, from 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>State</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>State of its bus controller; OP = operational</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>AL status</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why it left operation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames received</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Overruns</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Buffer overruns</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bad</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cycles refused because of it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Clock</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Clock offset from the bus clock, ns</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sensor temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Link</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Link errors counted by the camera</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Emerg.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Emergency messages</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Starts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Power-on count</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Firmware</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Version it reports</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Time</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Local start time</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera concerned</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What happened</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Description</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What to do</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cycles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Number of cycles affected</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Code</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>For support</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras on the bus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Events, newest first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no error</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not found</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO ANSWER</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Virtual cameras: the geometry of the rig document is used.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrated, verified and in date. Points can be taken.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No calibration of this rig is stored on this computer.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>name in the rig document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>with their serial numbers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>calibration method</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrated</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>when, and by whom</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Valid until</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no points are taken after this date</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Positions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>reference positions or poses used; outliers left out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Residuals</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>RMS of the residuals, and chi-square per degree of freedom</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Volume</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>calibrated volume, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Warmth</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ambient and sensor temperatures during calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>traceability: artefacts with serial numbers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verified</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>date, and the error closest to its limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hash</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the record or rig document; printed in jobs and reports</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall jobs (F12) shows which of their verdicts hold.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Status of the calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Focal length, Δ µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Principal point, Δu px</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Principal point, Δv px</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera distance, Δ µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verified error, % of limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{low} to {high}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>none, the rig document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{made_utc}, {error_mm:+.1f} of ±{limit_mm:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n left out</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>{around} °C, sensors {sensors} °C</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibration concerned, see the last column</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As entered, or the rule applied</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Good until</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>If suspect: last time known good</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>First digits of its hash</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Activated</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verification passed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verification FAILED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Marked suspect</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Artefact found WRONG</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jobs recalled</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>History, newest first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This overwrites the intrinsics stored in the cameras with those of the active calibration. Press W again to confirm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No tip calibrated yet: calibrate the probe with this tip.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Confirm that tip &apos;{tip}&apos; is now mounted? It must be checked before points are taken. Press N again to confirm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>tip {tip}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>good</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>late</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>bad</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bus cycles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>wrong</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>elapsed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select a folder of certified reference pairs (NAME.ds with NAME.fit) and the convention they follow. Every pair is fitted without a start value and compared.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>one folder of pairs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pairs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>pairs fitted and compared</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, worst; limit {limit:g}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Size</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rad, worst; limit {limit:g}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Apex</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>degrees, worst; limit {limit:g}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>whether every pair is within the limits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fitting</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fits against certified pairs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of reference pairs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Convention</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Convention of the certified values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Outcome</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is compared</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Worst errors</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Progress of the comparison</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All {pairs} pairs within the limits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{beyond} of {pairs} pairs beyond the limits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✔  AGREES</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✖  OFF</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Status</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>INACCURATE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pages</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down select a page</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Inspect  [M]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press Examine. It takes a few seconds; measuring continues meanwhile.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Examining. Numbers and maps below are from the previous run.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe document; empty: the probe in use</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Design</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Design document (materials, sections); empty: the one in the resources folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tilts, °</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Largest tilts of the probe about X, Y and Z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Spots, px</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Noise of an averaged spot</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the probe in use</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the one in the resources folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the uncertainty of one point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>standard uncertainty in space, RMS over the poses</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rests on</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>source values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Design of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Examine</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty of the tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Meaning of the number</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Labels</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nearest wrong orders</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Growth and bending</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Over the tilt</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From above</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the front</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tilts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Spots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Starting</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs cannot be confused</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs can be confused</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty of the tip in space from spot noise alone, probe &apos;{probe}&apos; with rig &apos;{rig}&apos;: X {x:.1f}, Y {y:.1f}, Z {z:.1f} µm; below {p95_um:.1f} µm in 95 of 100 poses. {share:.0f} % of the poses give a tip.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No pose gives a tip: the cameras do not see enough LEDs.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Thermal growth and bending need a design document.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Budget of one point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Virtual probe: the geometry of its document is used.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibrated, qualified and in date. Points can be taken.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No records of this probe are stored on this computer.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No tip calibrated yet: press P to calibrate the probe with the mounted tip.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>name in its document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>currently mounted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>diameter used for compensation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Qualified</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ambient, at probe calibration and tip qualification</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Turned</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rotation about the probe axes during calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the source of the geometry; printed in jobs and reports</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Status of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball diameter, Δ µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Form, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip from first position, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Quick check, % of limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name; an arrow marks the mounted tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Status of the tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Effective diameter and its standard uncertainty (k = 1)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Largest minus smallest radius</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cone, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two standard deviations of the tip over all attitudes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Date and temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Checked</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Last quick check since then</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No points are taken with it after this date</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record concerned, see the last column</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tips</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down select a tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>never</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>passed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>FAILED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall a folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculate the suspect jobs in a folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop recalculating; nothing is changed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write PDF</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the recall report (PDF)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Release points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Release points whose verdicts hold, under your name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>file of the job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>as in the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>value ± U and verdict with the calibration of the job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the same with the calibration its spots support</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>whether the verdict still holds</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>and why</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Storing the recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Creating the pages</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verdicts of the recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculating the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall the jobs from the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the recall into the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Result of the recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Findings of the recall</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Evidence for the selected verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the folder with the jobs (F7). Job files are not changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Checks the jobs in {folder}. Job files are not changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recall written to {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Meaning of the status</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Watch list</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why no history is shown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>UNCALIBRATED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points since {since_utc} are suspect, also in older jobs.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points are taken but prove nothing: every verdict is NOT PROVEN.{why}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No points are taken. {blocker}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Wire</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{link} cable to {name}, {state}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>this computer</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera sees no LED: {names}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: {count} spots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} cameras, at least {least} spots each</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Coverage of the feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Operator and part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Temperatures</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{part}   {done} / {count} features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature name</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NOT MEASURED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, description</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{taken} of {needed} points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Other characteristics of this feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Also</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>deviation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nominal</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Association and frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Outliers</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>1 of 3 NOT MEASURED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Note</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No tolerance on this feature.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Approach tone on.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Approach tone off.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Instruction of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probing order and probe side</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Approach to the next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Blocking reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next serial number, all other fields unchanged</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Other plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose another plan file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Resume the selected job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start a job for this part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Operator</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name of the operator</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the part; - if it has none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Order number; optional</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Batch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Groups parts for comparison; optional</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan of the next job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose the plan from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What to do next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Return moves to the next field and, after the last one, starts the job. Unfinished jobs are saved with all their points and paused when the next job has another plan; choose Continue to resume.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Jobs of this batch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down select a job; F7 resumes it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Which jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Current job: {job}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select a job in the list first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Starting the job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} (current job)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>changed since</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part {part}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading jobs in {folder}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Serial {serial}: {points} points, {operator}, {when} UTC, {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of batch {batch}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>without a batch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Other jobs {of}, in {folder}: {count}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verdict on the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n more</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Features in probing order; Page Up and Page Down change the active one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, {shape_word}, {count} of {needed} points, {progress_word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No points to select yet.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select a point first: press . or , or click its bar.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No deleted points on this feature.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Readout</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no valid position</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>world frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>by &apos;{name}&apos;</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ball centre, mm, {frame}   ±{uncertainty} (k=2)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Residuals of the points from the fitted feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points from the fit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Simulated: not a real part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>cameras that see the probe / in the rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Targets</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs that two cameras see / on the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reference</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs of the reference body that two cameras see / on it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>expanded uncertainty of a point here, mm, k = 2</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frames/s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>frames tracked per second</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Good</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>bus cycles on time</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Late</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>late bus cycles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>lost bus cycles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rejected bus cycles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>frames dropped because reconstruction was too slow</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reason for the status</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Distance to the next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>there</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe and tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip {tip}: {word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe {probe}: {word}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ball {diameter_mm:.4f} mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe {title}: {word}, nominal geometry, {ball}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No points: {blocker}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe {title}: {word}, {ball}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe {title}: {word} until {until}, {ball}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>UNCALIBRATED: no proof</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>UNCALIBRATED: results are not proven. {why} {warnings}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO POINTS: {blocker}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no file yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>saved</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>not saved yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Letters, digits, spaces, _ . -</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Names, separated by commas</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Normal or axis, part frame: x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Diameter, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Round shapes only; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Length, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Slots and rectangles; others if known, else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Positive side</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature on the positive side; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Starts from</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Initial alignment; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How the part frame is found; empty: no alignment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Covariance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of rotation and translation of the frame, rad and mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Simulated</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frame measured on a virtual rig</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SHA-256</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hash of the frame document; Shift+F9 imports one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shape</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Features to probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Number of points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe side: outer for shafts and faces, inner for bores</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Point, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Centre or a point on it, part frame: x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Width, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Slots and rectangles, tube of a torus; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Apex angle, °</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cone: full angle; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Along</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Direction of the length, part frame: x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Association</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fit criterion</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Projected on</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Projection plane of circles and slots; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe side by</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Empty: as in the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Targets, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where to touch, from a model; empty: spread over the sizes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Instruction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Instruction shown at this step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture file beside the plan; Shift+F7 attaches one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fitted in space</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Circle fitted in space at once, not plane first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Toleranced features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Datums</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Names in order of precedence, separated by commas; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, or degrees for angles; 0 for zones</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lower limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the deviation; 0 for zones</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Upper limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the deviation; the tolerance of a zone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Axis</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of coordinates and distances</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Empty: default of the kind</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Zone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Position and orientation; empty: default</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Modifier</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bonus: departure of the size from its limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limit size, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limit the modifier refers to; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Toleranced length of an axis; 0: probed length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Offset, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Offset of a profile zone; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>At, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cone: height of the diameter; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Faces</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the model, for a surface profile: what points are held against</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan name, used for file names</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name of the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Decision rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How the probe side is found</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>unproven: also such that cannot prove the age of their data</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Material</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Needed to report results at 20 °C; or empty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the material</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Expansion</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>1e-6/K; steel 11.5, aluminium 23.1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty, 1e-6/K; handbook value: 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Construction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Constructed features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two planes; plane and axis; three planes; two axes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature to project; plane or axis to project onto</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two points or centres</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two planes, or two lines or axes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Which</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>between: midway between two faces; across: square to it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pairs of centres in turn, or two faces</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature to move, and direction; one alone: its own</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Distance, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Negative: opposite direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Three centres or more; or features with points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the element</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Through</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Centres, or all probed points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Three holes or more</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A cone; or a cone and a plane</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the gauge circle; 0 with a plane</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the plane, along its normal; else 0</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The two balls: the farther first, the nearer second</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the second centre, as certified</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Surface, axis or centre</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Primary</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plane whose normal, or axis, is z of the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Secondary</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Two centres separated by a comma, or one line: x</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Origin</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature whose centre is the origin</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Primary gives</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Axis of the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Secondary gives</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plane</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Aligned to its nominal first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Second: line, axis or normal</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Third: a centre</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One to three, in order of precedence</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Three or more features with centres</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Weights</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One number per point; empty: equal weights</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Locked</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of x, y, z, rx, ry, rz, separated by commas</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seven or more single points on the faces</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the model; they come with an import</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Six conditions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One per line: feature, then direction x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rotation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>From the world to the frame, row by row</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Translation, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>In the frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Control points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature and its position in the frame, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limit, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A control point off by more than this has moved</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n free-form faces added.</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n features added from {name}.</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>CAD models (STEP) need an extra of some {size} MB: {command}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The frame {name} is used as saved.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The frame {name} will be relocated at its control points.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Importing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Importing {name}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shift+F9 cancels.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Importing: {what}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Features of the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is chosen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why the selected surface is not chosen</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Axis that points up</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>How the part stands</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Profile of free forms, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Width of the zone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take over  [Return]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take the chosen surfaces over as features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Go back without features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} of {all} surfaces are chosen.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Enter the profile of free forms.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} can be touched.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: points and their profile against the model.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}: {why}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Surfaces of the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Space chooses, Return takes over, Esc goes back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Free form</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Checks</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✖  Not applied: {what} {remedy}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✔  The plan is valid and can be measured.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>▲  The plan can be measured. {doubts}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture of {names} not found beside the plan: the feature is drawn instead.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Items of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down select an item</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Alignment   {rule}</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n points</source>
        <comment>1 point</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Add a feature after the selected one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Construct</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add a construction from the selected feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tolerance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add a characteristic of the selected feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Define the part alignment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove the selected item</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Earlier</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Move the selected item up</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Later</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Move the selected item down</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Undo the last change</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Redo the last undone change</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Attach a picture to the selected feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Teach</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take the nominals from the current part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Import</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Import features from CSV or STEP, or a frame document for the alignment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start a new plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open another plan file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the plan to a file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Measure</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start a job with this plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan settings</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the plan into the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Import the features or frame from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the features or frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Attach the picture from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the picture</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Attach</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the plan from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add the features to construct from first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the feature to tolerance first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing to undo.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing to redo.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing was imported.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save the plan first (F8): a job starts from its file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This plan has unsaved changes: save it (F8) or undo them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The nominals now match the part.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing has changed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{what} F10 undoes this.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PLAN</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PART</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>FEATURE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>CONSTRUCTION</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Progress of teaching</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reading the job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rounding the nominals</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✔ taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>▲ in part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>✖ refused</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>dimensions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>tolerances</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>datum references</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>datums</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>datum targets</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>labels and notes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>others</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tolerances of the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What became of the tolerances of the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Every item of the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Whether it is in the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Label</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its name in the model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Says</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What the model says</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>In the plan, or why not</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Characteristics, datums, or the reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take over the tolerances</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take over</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Features only</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take over the features without tolerances</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{taken} of {count} {group}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Taken as a whole: {counts}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n characteristics will be added.</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Drawing the PDF</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Writing and verifying the files</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>With the points taken so far</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Accept</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Record in the job that this alignment was accepted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>in brackets: not used for the frame, only checks it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, deviation from nominal, in the frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>off</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, length of the deviation vector</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, U of the distance, in its least certain direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>turned, °</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>angular deviation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Degrees of freedom</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Notes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty of the frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Progress of the calculation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No alignment to accept yet.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The alignment was accepted: results are in the {frame}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Results are in the {frame}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No frame yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Still free: {free}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fully constrained</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>U (k=2) of the origin, x y z: {shifts} mm. Of rotations about x y z: {turns}°.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A: from the observations of this job; B: from other sources; distribution</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>standard uncertainty contributed to the result; m° for angles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Share</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the variance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty budget</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty budget as bars</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Together, u</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose a folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compare the jobs in a folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show only what is about one feature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write a table (.csv) or pages with the charts (.pdf)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Stop reading the jobs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>included</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Mean</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, or degrees for angles</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cp</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>tolerance relative to the scatter of the parts</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cpk</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>relative to the nearer limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>95 %</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>confidence interval of Cpk</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Signals</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the control chart</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Characteristics of the batch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compare the jobs from the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compare</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Feature; empty for all</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the table of the batch to</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the table</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Findings of the chart</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Excluded</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the folder with the jobs of the batch.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Pages of the batch written to {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{origin}{count} jobs of plan {plan}, {first} to {last}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Writing the pages</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{path}: the file cannot be written ({reason}).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Table of the batch written to {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>And %n more.</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>{included} of {count}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviations of the touched places</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Arrow keys rotate the view, plus and minus zoom.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Looking for causes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculating the alignment</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculating the uncertainties</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points that determine the value</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Marked: {points_words}. Arrow keys rotate the view, plus and minus zoom.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cameras: {cameras}. Probe: {probe}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Current job {job}, part {part}. {who}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recomputed from raw data: matches the file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name}, read-only, part {part}. {who}. {doubts}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Template</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>TOML file; empty: the station&apos;s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>For whom it was measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Order, where the job has none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Drawing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Drawing of the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Revision</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Revision of the drawing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where it was measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Received</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Date and condition</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviations</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Parted by semicolons</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Head of the report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fault of the template</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Mark</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select or clear this format</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the selected formats to the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>F8 cancels.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Formats</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Up and down show a preview, Space selects a format</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The job is not complete</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Writing the report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Report folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Preview</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Preparing the preview</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The report was not written.</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n files</source>
        <comment>1 file</comment>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>INCOMPLETE report of {job} written to {folder} ({files}).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not measured: {missing_words}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Written to {folder}: {names}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>INCOMPLETE: {missing_words} not measured. Write the report of {job} anyway?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Analysing the cause ...</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculating the budget from the job file.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Selected result</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Monte Carlo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Simulation cancelled.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Trials run in a separate process. F6 stops them.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>F6 checks U by Monte Carlo (JCGM 101).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rule: {rule}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The value lies inside.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The value lies outside.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>95 % interval {low} to {high}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tolerance over 2 U: {tur:.1f}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Association: {association}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frame: {frame}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Noise floor: {floor}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bonus {bonus}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Monte Carlo (JCGM 101), {trials:,} trials: 2 u = {width:.2f} {unit}, interval {low} to {high}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the ends differ by {off:.2f} {unit}, tolerance {tolerance:.2g} {unit}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>It does not confirm linear propagation: {differ}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>It confirms linear propagation: {differ}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>More trials are needed to be certain.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>kind and features</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>measured minus nominal</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the deviation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>expanded uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>the decision</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Check this uncertainty by Monte Carlo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open a job file read-only</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Current job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show the current job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compare the jobs in this folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Preview and write the reports</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open the job from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Opening a job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Summary</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The job was not opened.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Opening {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>F7 cancels.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Image of camera {name}</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>{name}:  %n spots</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>{told}, {named} named</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera images</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{number} outlier</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>point {chosen}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>next, roughly</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>next</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} too much</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} too little</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} accepted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} within, not accepted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{count} held back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{feature} {deviation:+.3f} mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviation from the middle of the zone, × {factor:g}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>lower limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>upper limit</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Colour: between points, to {reach:.1f} mm. Grey: not measured.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture of the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Arrow keys rotate the view, plus and minus zoom, F fits it to the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No model</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>3-D view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part placed roughly: not aligned yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part not located yet. Touch {feature}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture of the step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>world axes, grid {grid_step:.0f} mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No certificate can be written.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This window was opened without acceptance tests.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mode in which the key works</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>any of them</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>on the button</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What it does</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>in a sentence</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>. (full stop)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>, (comma)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keys of the window</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>F1 to F5, F11 and F12 mean the same everywhere; F6 to F10 belong to the page. Settings changes keys.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>everywhere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source> or </source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Desk view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculating the results</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points are taken again: {title} is {word}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SIMULATED: a robot hand measures a virtual part. No number is of a real part.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Z pauses it, Ctrl+H goes to the Start page.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The cameras now store the intrinsics of the calibration.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The cameras on their wire</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calibration status of the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Status of probe and tip</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe design</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty of the tip and its causes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Fits</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Check of the fits against certified pairs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Acceptance tests, interim checks, artefacts and gauge studies</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Acceptance</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No calibrations of these cameras are kept.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No records of this probe are kept.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select a test on page Acceptance, or open page Calibration or Probe.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe saved in {path}. Choose it in Settings (Instrument), then calibrate it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the report into the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of the report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the bus report into the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the bus report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>E cancels.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The bus report is in {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Log written to {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Write the certificate into the folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of the certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Writing the certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Certificate written: {path}, with DCC and signature.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan saved in {path}. Shift+F8 starts a job with it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reference points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>List of positions: unit, uncertainty, points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Length bar</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its document, with the certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>World frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reference of the coordinates afterwards</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>fixed to the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>fixed by known control points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>redefined by three points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Their list, if known points keep the world frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lenses</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lens parameters</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>refined from known values</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>unchanged</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>found anew</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Source of the LED positions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>known within their uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>known exactly</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>unknown: scale from the bar alone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Not the one used to calibrate the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its document; empty for none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sphere in</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Number of places in the volume</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>one place</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>near and far third</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reason, for the history</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A reason is required</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Decision</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reason</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Yes  [Return]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No  [Esc]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plot 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show plot 1</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plot 2</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show plot 2</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plot 3</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show plot 3</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plot 4</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Show plot 4</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Take an observation now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Undo the last observation of this step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Go to the next step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back to the previous step; nothing is lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Automatic</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Turn automatic taking on or off</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Skip this point: no camera sees it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeat line</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeat a misplaced or failed line</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Repeat sweep</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Discard this sweep and repeat it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Recalculate the result</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cancel the calculation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Activate the result</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keep the old</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>End without changes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leave</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back to Maintain; the session can be resumed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Cone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Its marking; empty if none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Marking on the mounted stylus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where the tip is</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What is already known of it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>close to the probe document or the last calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>unknown: another stylus</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nominal diameter</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Currently mounted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Steps</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Step {current} of {count}: {title}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{done} of {wanted}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The new calibration is active. Verify it: until then it is SUSPECT and no points are taken.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A positioning machine moves one bright target to every point of a list, through the full depth of the volume. Lens parameters and camera poses are computed from the images.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Errors at points held back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Use after the frame or a camera was moved: visit two seats, wave the probe through the volume, show the length bar, touch the control points, and visit the seats again. No measuring machine needed.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Misfits of bar and control points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>An independent check: visit two seats, put the ball into the nests of a certified length bar along seven lines, touch a certified sphere, and visit the seats again. Only a calibration that passes can be used.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Verdict stored.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rest the ball in a cone and pivot the probe about it, repeat in another cone or leaning another way, then return to the first cone. Tip and LED positions are computed from the sweeps.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The new probe calibration is active. Qualify the tip: until then it is SUSPECT and no points are taken.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Touch a certified sphere all around, then rest the ball in a cone in five attitudes. This gives the diameter and form of the ball, and shows whether the tip stays in place.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip verdict stored.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>One minute on the sphere and in the cone: is the tip still as qualified?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Wizard</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Step</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Why Next is locked</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Automatic: ON
[Y]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Automatic: off
[Y]</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The cameras use the rig document: no calibrations are stored.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose real cameras, or a folder of camera records, in Settings (Instrument).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The probe uses its document: no records of it are stored.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Choose real cameras, or a folder of tip records, in Settings (Instrument).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No probe selected.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Purpose</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start a new session</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Resume the selected session</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leave the wizard</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Unfinished sessions</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Details of the selected session</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>New session</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing was lost.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name of the probe, used in its records</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Centre of the ball in the probe frame: x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Diameter from the maker&apos;s certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball ±, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty of the diameter</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip ±, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainties of its position: x y z</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs ±, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty of each coordinate of an LED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Light, °</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Largest viewing angle off its direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rules</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Orientation rules: probe axis &gt; direction; x y z &gt; x y z; …; empty: none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Strobe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Period in frames: dark frame of each LED; empty: always on</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>New name; a used document is never changed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>always on</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>its number</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mm, probe frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>emission direction; length is ignored</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>emission direction</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball ±</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip ±</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LEDs ±</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Light</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The axis of an orientation rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The direction of an orientation rule</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Frame of the strobe code</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Enter LED and ball positions. LED ambiguity is checked as you type. Then choose the new document in Settings (Instrument) and calibrate the probe.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Define a probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Read the probe document from the file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File of the probe document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Back; unsaved changes are lost</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Start from another document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>As measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Use the LEDs of the active calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add LED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Add an LED, copying the last one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove LED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Remove the selected LED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Save as a new document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>EXAMINING</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>GOOD</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>CANNOT BE USED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SAVED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe saved in {path}.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: each is dark in a different frame.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: the orientation rules exclude every other order.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The LEDs cannot be confused: the nearest wrong order, {order}, misses by {residual_mm:.1f} mm; it would put the tip {tip_error_mm:.0f} mm off.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>With {hidden} hidden, the nearest wrong order misses by {residual_mm:.1f} mm.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>coordinate in the frame of the probe document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>This, mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>this calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>standard uncertainty (k = 1)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>2nd, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>second minus first sweep</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>standard uncertainty of that difference (k = 1)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Spheres, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>mean of the sphere centres (thesis 3.2), minus this</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Change, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>this minus the active calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>in the frame of the probe document</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>second sweep from first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>against the active calibration</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Before and after</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What changes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tip compared</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The LEDs compared</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>LED sphere centres scatter {spread:.1f} µm (RMS) about their mean.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Paths</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Before/after</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tip moved by {tip_distance:.3f} mm. Why?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>TIP CHANGED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tip has moved by {tip_distance:.3f} mm. Accept only if you know why; you will be asked for the reason.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>USABLE, LOOK</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The calibration can be used, but with reservations; see below.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Both sweeps give the same tip. After accepting, qualify the tip on the sphere.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>second</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>2nd sweep</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{distance} away</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Poses</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{used}, {left_out} left out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>chi² / dof</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Articulation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>tip {axis}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>First calibration of this tip: nothing to compare with.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Since the calibration of {when:%Y-%m-%d} the tip moved by {tip_distance:.4f} mm and the LEDs by {led_rms:.4f} mm (RMS).</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe attitudes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} {poses} of {wanted}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>done</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Volume shown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty of a length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{done} poses of {wanted}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Missing: {cells}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing is missing</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Bar placements</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A suitable next bar placement</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points of the world frame</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{taken} of {count} points taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The world fixed to the cameras.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Origin: (0, 0, 0)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>On X: the X axis passes through it</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>In XY: on the side of positive Y</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points touched</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>nothing to touch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of {length_mm:.0f} mm; too early to tell</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of {length_mm:.0f} mm (k = 1); {limit:.1f} µm is enough</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>placement {number}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>which camera</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Shift mm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>shift of its centre, common motion removed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Turn mrad</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>rotation, common motion removed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>focal length, after minus before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>principal point, after minus before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Changes of the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points of the volume, after minus before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>First calibration of these cameras: nothing to compare with.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>All cameras together moved by {moved_mm:.3f} mm and rotated by {turned_rad:.3f} mrad; the remaining change of each camera is below. Standard uncertainty of a length: {before} before, {after} after.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sensors</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Histogram</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Space</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No objections to this calibration. After accepting, verify it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>no points held back</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Used</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Left out</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Focal length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Errors RMS</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Length</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{before} before, {after} after (k = 1)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where to touch the sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{title}: {taken} points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points on spheres</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No sphere chosen: press Next.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sphere {number} of {count}: {taken} of {sphere_points}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leaning</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Leaning the other way</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Turning the handle</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Ball in the cone: keep it there.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sweep</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Directions of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Rotation of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>(k = 1); {wanted:.0f} µm is enough</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>too early to tell</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Attitudes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>First cone again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Directions of the first sweep</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The first cone again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>COMPLETE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing is missing.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>BACK INTO THE FIRST CONE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>held as at the start</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>STARTS IN {seconds}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>SWEEP</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>BALL LEFT THE CONE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>BALL INTO THE CONE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Away from the first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Check</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>quantity checked</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>value found</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>expanded uncertainty (k = 2)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Limit, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>of the error</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>quantity compared</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>this qualification</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>previous qualification</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>now minus before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Errors in numbers</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n points, form {form:.1f} µm</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>angle from the pole</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Now and before</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PASSED</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store the verdict; points can then be taken with this tip.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Clean ball, sphere and cone, tighten the stylus and qualify again. If it fails again, calibrate the probe or change the stylus.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Diameter</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{form_mm:.1f} µm, {points} points</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>In the cone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Largest</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tip is still as qualified. Store the verdict and continue.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The tip is no longer as qualified. Store the verdict: no points are taken until the tip is qualified or the probe calibrated.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>2s in the cone, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Largest in the cone, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Point, µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Temperature, °C</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Made</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Touch</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Places on the sphere, seen from its pole</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Diameter of the ball</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Coverage of the sphere</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>TOUCH</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{nominal_mm:.4f} expected</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Places</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Uncertainty of the diameter</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>… with all places</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hold</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Spread of the tip (2 s)</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>at most {limit:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>after two attitudes</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tips about their mean</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>largest {largest:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>none yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>HOLD STILL  {seconds_left:.1f}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Taken automatically.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Press Space to take it.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>READY</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>TAKEN</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next: {where}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>one more point, as shown on the map</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{failed} of {checks} failed</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{name} {error_mm:+.1f} µm, limit {limit_mm:.1f} µm</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reservations</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Error</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>First: {error}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store the verdict; the calibration can then be used.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>A line was repeated and the verification failed: store it and calibrate again.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>If only one line failed, repeat it once. If it fails again, store the verdict and calibrate again. Jobs since the last good verification are then suspect: Recall jobs (F12), on page Calibration, shows which of their verdicts hold.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Figures and reasons</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of the room; empty if not measured</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{ended} Press Esc to leave.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No result to accept; see the reason and remedy above.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nothing to accept yet: calculate the result first.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Complete: continuing.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next is ready: press Return.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Next is locked: {reason} {remedy}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>The session</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n spots</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Camera view</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seen now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>What to do now</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>WAIT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{text} {frames} of {wanted} frames.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Accept the new</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Activate this calibration?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>End and keep the old calibration?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store the verdict</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Discard</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Store this verdict?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>End without a verdict?</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where to go</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>complete</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Select the next point</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Nests taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>all lines taken</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Seats visited</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>both seats visited</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>seat {number}</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>nest {done}</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n reference points</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message numerus="yes">
        <source>%n measuring lines</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>Volume in front of the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Deviations from the recommended plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Begun</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>{wanted} wanted</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Session file</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Picture of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message numerus="yes">
        <source>%n LEDs</source>
        <translation type="unfinished">
            <numerusform></numerusform>
            <numerusform></numerusform>
        </translation>
    </message>
    <message>
        <source>no LEDs yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>ball</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plots</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Result</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Result of the calculation</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Figures of the result</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Objections</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No plots yet</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Calculating …</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>No result to show</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>CALCULATING  {calculating_s:.0f} s</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Window and session stay as they are; C cancels the calculation.</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>NO RESULT</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Instrument</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Report head</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Live stream</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Window</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>simulated, ethercat:INTERFACE, ethercat:service or replay:FILE</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Document of the cameras</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Document of the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Name of the mounted tip; empty: as its records say</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Reference body</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Document of the LEDs fixed to the part; empty: none</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Camera records</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of calibrations; empty: of this user</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Tip records</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Folder of probe and tip records; empty: of this user</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Check the tip after</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Hours without a point or a check</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Job folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where jobs and reports are written</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Plan folder</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Where plans are looked for; empty: recent places only</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Proposed for a new job</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Users</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Names proposed as operator, parted by semicolons</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Measured today; empty: unknown</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Part expansion</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Empty: by the material of the plan</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compensate the part</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Report coordinates at 20 °C</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Probe temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Document of its materials: growth and bending</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Compensate the probe</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Use its geometry at its temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Standard uncertainty</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of each temperature</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Temperatures hold for</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Older ones are not used: measure again</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Over every report</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Address</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Lines, parted by semicolons</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Logo</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PNG or JPEG</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Report template; empty: the plain one</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Port</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Points and poses for other programs; empty: off</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Address of this computer</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Other computers need a token</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Token</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>File with the token, readable by you alone</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PEM; the stream then speaks TLS</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Private key</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>PEM, of that certificate</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Language</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Of all sentences; system: that of the computer</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>system</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Colours of the window</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>dark</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>light</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>contrast</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Sounds</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Play sounds</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Far view first</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Open jobs in the view for three metres</source>
        <translation type="unfinished"></translation>
    </message>
    <message>
        <source>Keys that differ from those shipped</source>
        <translation type="unfinished"></translation>
    </message>
</context>
</TS>
